//! `gestus build`.

use std::{
    path::{Path, PathBuf},
    time::Instant,
};

use anyhow::{Result, bail};
use gestus_core::blob::layout::{ALIGNMENT, MAX_FEATURES, entry, section};
use gestus_database::{
    blob::assemble::with_section,
    build::{BuildError, BuildOptions, Built, Choice, build},
    command_line::{
        options::ReportArgs,
        outputs::{counted, counted_as},
    },
    data_folder::{
        balance::balanced,
        config::{Config, FILE_NAME},
        left_out::Group,
        rig::Rig,
    },
    effort::{
        Source,
        dial::doubts,
        fragment::{self, Library},
        model::Model,
        response,
    },
    pairing::Scheme,
    parts::choose::Wanted,
    registration::timeline::Kind,
};
use gestus_motion::corpus::Corpus;
use serde_json::json;

use super::{
    fit::{self, FitArgs},
    open,
    rig::RigArgs,
    selection::{GroupArgs, Selection, load_with_notes},
};

/// Build a database from a folder of BVH and glTF files.
// What the options of several commands do to a database.
#[derive(clap::Args)]
#[command(
    mut_arg("styles", |a| a.help("Styles to use, s,t; default: all. The first is the stylizer's initial output style")),
    mut_arg("joints", |a| a.help(
        "Joints to keep, a,b. The parent of each must be among them. Fewer joints take less memory"
    )),
    mut_arg("rate", |a| a.help("Frames a second of the database, from 1 to 1000")),
)]
pub struct Args {
    /// Folder of clips; its gestus.toml, where it has one, says what they are
    #[arg(long, required_unless_present = "config")]
    data: Option<PathBuf>,
    /// Configuration, as gestus.toml, instead of the folder's own
    #[arg(long)]
    config: Option<PathBuf>,
    /// The database to write
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    selection: Selection,
    #[command(flatten)]
    groups: GroupArgs,
    #[command(flatten)]
    rig: RigArgs,
    /// How output cycles are chosen: both (the default), spread, viterbi, nearest, kernel, mean or take
    #[arg(long, value_parser = scheme)]
    pairing: Option<Scheme>,
    /// Style that the linear models take; default: `normal` or `neutral`, or else the first
    #[arg(long)]
    from: Option<String>,
    /// Most cycles of each action and style; those are kept that represent the others best; default: all
    #[arg(long)]
    cycles: Option<usize>,
    /// Components of a search feature, 1 to 32
    #[arg(long)]
    features: Option<usize>,
    /// Leave out the search graph, 16 bytes a frame; --bytes does so too
    #[arg(long)]
    no_graph: bool,
    /// Mean error of a stored pose's joints, centimetres, from 0.0001 to 10. Less error takes more bytes
    #[arg(long, value_name = "CM")]
    row_error: Option<f64>,
    /// Greatest size of the database, as 512K, 1M or 65536: chooses row error, features and cycles for it
    #[arg(long, value_name = "SIZE", value_parser = size, conflicts_with_all = ["row_error", "features"])]
    bytes: Option<usize>,
    #[command(flatten)]
    fit: FitArgs,
    /// Leave out the phase tables, the linear models and the statistics
    #[arg(long, conflicts_with = "from")]
    no_models: bool,
    /// Labels of Effort that people gave: a filled-in table of `gestus effort sheet`; default: estimates
    #[arg(long, conflicts_with = "no_effort")]
    labels: Option<PathBuf>,
    /// Add the effort dial, for `--effort` of other commands. It is measured, which takes most of the time of a build.
    /// --labels adds it too
    #[arg(long, conflicts_with = "no_effort")]
    effort: bool,
    /// Without the effort dial, as is the default
    #[arg(long)]
    no_effort: bool,
    #[command(flatten)]
    report: ReportArgs,
}

fn scheme(name: &str) -> Result<Scheme, String> {
    Scheme::named(name).ok_or_else(|| Scheme::ALL.map(|(name, _)| name).join(", "))
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    let start = Instant::now();
    let (config, wanted) = args.configure()?;
    let loaded = load_with_notes(&config)?;
    let (corpus, incomplete) = balanced(&loaded.corpus, !config.styles.is_empty());
    let left_out: Vec<Group> = Group::all(&loaded.left_out).into_iter().chain(incomplete).collect();
    let count: usize = left_out.iter().map(|group| group.clips.len()).sum();
    if count > 0 {
        super::note(format_args!("files or clips left out: {count} (--strict makes that an error)"));
        left_out.iter().flat_map(Group::lines).for_each(|line| super::note(format_args!("  {line}")));
    }
    if let [style] = &corpus.styles[..] {
        super::note(format_args!(
            "all clips have the style {style}: there is no other to learn the difference to, and the database translates \
             nothing into something else; add clips of a second style, or say by `patterns` or `files` in {FILE_NAME} which \
             clips have it"
        ));
    }
    let build = |options: &BuildOptions| build_with_dial(&corpus, options, args);
    let (built, chosen) = fit::build_for(wanted.as_ref(), &corpus, &config.build, build)?;
    built.notes.iter().for_each(super::note);
    open::write(&args.output, &built.bytes)?;
    let database = open::open(&args.output, &built.bytes)?;
    doubts(&database).iter().for_each(super::note);
    let figures = super::inspect::figures(&database, built.bytes.len())?;
    if args.report.json {
        let mut figures = figures;
        // A database of some cycles holds each in a clip of its own.
        figures["clips"] = json!(corpus.examples.len());
        figures["skipped"] = json!(count);
        figures["left_out"] = left_out.iter().map(Group::json).collect();
        let floors = loaded.floors.iter().map(|(clip, height)| (clip.clone(), json!(height)));
        figures["floors"] = floors.collect::<serde_json::Map<_, _>>().into();
        figures["rig"] = loaded.rig.as_ref().map(Rig::json).into();
        if let Some(choice) = &built.choice {
            figures["row_error_cm"] = json!(choice.row_error_cm);
            figures["features"] = json!(choice.features);
            figures["cycles_per_class"] = json!(choice.cycles);
            figures["error_cost_percent"] = json!(choice.error_cost_percent);
        }
        if let Some(chosen) = &chosen {
            figures["fit"] = chosen.json();
        }
        figures["seconds"] = json!(start.elapsed().as_secs_f64());
        super::say(&figures)?;
    } else {
        super::say(format_args!(
            "{}: {} frames of {}, {}, {:.1} bytes a frame, in {:.1} s",
            args.output.display(),
            figures["frames"],
            counted(corpus.examples.len(), "clip"),
            counted_as(figures["classes"].as_array().map_or(0, Vec::len), ["class", "classes"]),
            figures["bytes_per_frame"].as_f64().unwrap_or(0.0),
            start.elapsed().as_secs_f64()
        ))?;
        super::say(labels(&corpus))?;
        if let Some(style) = database.linear_from().and_then(|from| corpus.styles.get(usize::from(from))) {
            super::say(format_args!(
                "linear models (`--method lti`) take input of the style {style}; --from states another"
            ))?;
        }
        if let Some(choice) = &built.choice {
            super::say(described(choice, built.bytes.len()))?;
        }
        for line in fit::lines(chosen.as_ref(), &args.output) {
            super::say(line)?;
        }
    }
    Ok(())
}

impl Args {
    /// The folder's configuration with the options of the command, and the part that the database is for.
    fn configure(&self) -> Result<(Config, Option<Wanted>)> {
        let mut config = self.selection.config(self.data.as_ref(), self.config.as_ref())?;
        self.groups.apply(&mut config.build)?;
        self.rig.apply(&mut config)?;
        super::check_outputs(
            [
                config.data.as_ref(),
                self.config.as_ref(),
                self.labels.as_ref(),
                config.rig.as_ref(),
                config.rig_map.as_ref(),
            ],
            [("-o", Some(&self.output))],
        )?;
        config.build.pairing = self.pairing.unwrap_or(config.build.pairing);
        config.build.models &= !self.no_models;
        config.build.from = self.from.clone().or(config.build.from);
        self.choose_size(&mut config.build)?;
        let wanted = self.fit.wanted(&mut config, self.selection.frames.rate)?;
        Ok((config, wanted))
    }

    /// Applies the options that decide how large the database is.
    fn choose_size(&self, options: &mut BuildOptions) -> Result<()> {
        if self.cycles == Some(0) {
            bail!("--cycles 0: keep at least one cycle");
        }
        if let Some(features) = self.features.filter(|f| !BuildOptions::FEATURES.contains(f)) {
            bail!("--features {features}: from 1 to {MAX_FEATURES}");
        }
        if let Some(error) = self.row_error.filter(|e| !BuildOptions::ERRORS_CM.contains(e)) {
            let (least, most) = (BuildOptions::ERRORS_CM.start(), BuildOptions::ERRORS_CM.end());
            bail!("--row-error {error}: centimetres from {least} to {most}");
        }
        options.cycles = self.cycles.unwrap_or(options.cycles);
        options.features = self.features.unwrap_or(options.features);
        options.error_cm = self.row_error.unwrap_or(options.error_cm);
        options.graph &= !self.no_graph;
        options.bytes = self.bytes.unwrap_or(options.bytes);
        Ok(())
    }
}

/// Bytes of a size with or without K or M, multiples of 1024.
fn size(text: &str) -> Result<usize, String> {
    let text = text.to_ascii_uppercase();
    let text = text.strip_suffix('B').unwrap_or(&text);
    let units = [('K', 1 << 10), ('M', 1 << 20)];
    let (number, unit) = units
        .into_iter()
        .find_map(|(unit, bytes)| Some((text.strip_suffix(unit)?, bytes)))
        .unwrap_or((text, 1));
    let bytes = number.parse::<f64>().ok().map(|n| n * f64::from(unit)).filter(|n| (1.0..=4e9).contains(n));
    bytes.map(|bytes| bytes as usize).ok_or_else(|| "expected bytes, as 512K, 1M or 65536".to_owned())
}

/// The actions with their kinds, and the styles: swapped labels show here.
fn labels(corpus: &Corpus) -> String {
    let kind = |action: usize| match corpus.examples.iter().find(|e| e.action == action) {
        Some(example) if Kind::of_cycle(&example.cycles[0]) == Kind::Gait => "gait",
        _ => "whole",
    };
    let actions: Vec<String> =
        corpus.actions.iter().enumerate().map(|(i, name)| format!("{name} ({})", kind(i))).collect();
    format!("actions: {}; styles: {}", actions.join(", "), corpus.styles.join(", "))
}

/// What was chosen for a wanted size, in words.
fn described(choice: &Choice, bytes: usize) -> String {
    let cycles = match choice.cycles {
        0 => "all cycles".to_owned(),
        1 => "1 cycle of each action and style".to_owned(),
        cycles => format!("{cycles} cycles of each action and style"),
    };
    let cost = match choice.error_cost_percent {
        Some(cost) => format!("{cost:+.1}% error on held-out cycles"),
        None => "its error is unknown, since no cycle with a captured output could be held out".to_owned(),
    };
    let Choice { row_error_cm, features, .. } = choice;
    format!("{bytes} bytes: rows at {row_error_cm} cm, {features} features, {cycles}; {cost}")
}

/// Builds a database and adds the effort dial, which is measured with all cycles, whatever is kept of them.
fn build_with_dial(corpus: &Corpus, options: &BuildOptions, args: &Args) -> Result<Built> {
    if !args.effort && args.labels.is_none() {
        return Ok(build(corpus, options)?);
    }
    let labels = args.labels.as_deref();
    if options.cycles == 0 && options.bytes == 0 {
        let mut built = build(corpus, options)?;
        if let Some(dial) = dial(&built.bytes, corpus, labels)? {
            built.bytes = with_section(&built.bytes, section::EFFORT, &dial)?;
        }
        return Ok(built);
    }
    let all = build(corpus, &BuildOptions { cycles: 0, bytes: 0, models: false, ..options.clone() })?;
    let dial = dial(&all.bytes, corpus, labels)?;
    // Its section, padded, and its entry in the table.
    let reserved =
        dial.as_ref().map_or(0, |d| d.len().next_multiple_of(ALIGNMENT) + ALIGNMENT + entry::LENGTH);
    let bytes = if options.bytes == 0 { 0 } else { options.bytes.saturating_sub(reserved).max(1) };
    let mut built = match build(corpus, &BuildOptions { bytes, ..options.clone() }) {
        Err(BuildError::Size { least, .. }) => {
            return Err(BuildError::Size { wanted: options.bytes, least: least + reserved }.into());
        }
        built => built?,
    };
    if let Some(dial) = dial {
        built.bytes = with_section(&built.bytes, section::EFFORT, &dial)?;
    }
    Ok(built)
}

/// The section of the effort dial, or why there is none, on standard error.
fn dial(bytes: &[u8], corpus: &Corpus, table: Option<&Path>) -> Result<Option<Vec<u8>>> {
    let database = gestus_core::Database::open(bytes)?;
    let model = match table {
        Some(path) => {
            super::effort::labelled(path, corpus.rate_hz, |spans| Library::annotated(corpus, spans))?
        }
        None => Model::of_database(&database)?,
    };
    if model.library.fragments.is_empty() {
        super::note(format_args!("no effort dial: no cycle is as long as {} frames", fragment::MIN_FRAMES));
        return Ok(None);
    }
    let dial = match response::solve(&database, corpus, &model, corpus.plain_style())? {
        Ok(dial) => dial,
        Err(reason) => {
            super::note(format_args!("no effort dial: {reason}"));
            return Ok(None);
        }
    };
    let unused: Vec<&str> = (dial.styles.iter().zip(&corpus.styles))
        .filter_map(|(effort, style)| effort.is_none().then_some(style.as_str()))
        .collect();
    if !unused.is_empty() {
        super::note(format_args!(
            "the effort dial leaves out {}: no fragment of it has a label, or is as long as {} frames",
            unused.join(", "),
            fragment::MIN_FRAMES
        ));
    }
    if let Some(path) = table.filter(|_| dial.source != Source::Given) {
        super::note(format_args!(
            "{}: {} fragments have labels, the effort dial takes {} of {} frames or more: it is made of estimates; fill in \
             more rows",
            path.display(),
            model.library.fragments.len(),
            response::MIN_GIVEN,
            fragment::MIN_FRAMES
        ));
    }
    Ok(Some(dial.section()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_have_units() {
        let sizes = ["65536", "64K", "64kb", "0.5M", "1m"].map(|text| size(text).unwrap());
        assert_eq!(sizes, [65_536, 65_536, 65_536, 524_288, 1_048_576]);
        for wrong in ["", "K", "0", "-5K", "1G", "ten", "64KK", "64MB B", "64BBB", "64KBB"] {
            assert!(size(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn what_was_chosen_is_told_in_words() {
        let choice = Choice { row_error_cm: 0.2, features: 12, cycles: 6, error_cost_percent: Some(1.26) };
        assert_eq!(
            described(&choice, 500),
            "500 bytes: rows at 0.2 cm, 12 features, 6 cycles of each action and style; +1.3% error on held-out cycles"
        );
        let choice = Choice { cycles: 0, error_cost_percent: None, ..choice };
        assert!(described(&choice, 500).contains("all cycles; its error is unknown"));
    }
}
