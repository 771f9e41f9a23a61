//! `gestus inspect` and `gestus export`.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::PathBuf,
};

use anyhow::Result;
use gestus_core::{
    Database, Effort,
    blob::layout::{ALIGNMENT, entry, section},
    stylizer::effort_dial::{Dial, Labels},
};
use gestus_database::{
    blob::export,
    command_line::{options::ReportArgs, stylizer_args::methods},
    effort::dial::{doubts, fixed_factors, styles_alike},
};
use serde_json::{Value, json};

use super::open;

/// Show what is in a database, and verify it.
#[derive(clap::Args)]
pub struct InspectArgs {
    /// The database
    db: PathBuf,
    #[command(flatten)]
    report: ReportArgs,
}

/// Write the arrays of a database that a stream is recomputed from as .npy, and the manifest as JSON.
#[derive(clap::Args)]
pub struct ExportArgs {
    /// The database
    db: PathBuf,
    /// Folder for the arrays
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    report: ReportArgs,
}

/// Sizes and contents of a database.
pub fn figures(database: &Database<'_>, bytes: usize) -> Result<Value> {
    let counts = database.counts();
    let manifest = database.manifest()?;
    let all = database.sections().into_iter().chain(database.optional_sections());
    let sections: serde_json::Map<String, Value> = all
        .map(|(id, content)| (section::name(id).unwrap_or("?").to_owned(), json!(content.len())))
        .collect();
    let models: serde_json::Map<String, Value> = database
        .optional_sections()
        .map(|(id, content)| {
            let styles = counts.styles.max(1);
            let name = section::name(id).unwrap_or("?").to_owned();
            (name, json!({ "bytes": content.len(), "bytes_per_style": content.len() / styles }))
        })
        .collect();
    // Bytes a frame are those of a plain database, without the models' sections and their entries in the table.
    let models_bytes: usize = database
        .optional_sections()
        .map(|(_, content)| content.len().next_multiple_of(ALIGNMENT) + entry::LENGTH)
        .sum();
    let plain = bytes.saturating_sub(models_bytes);
    let from = |style: Option<u16>| style.and_then(|s| manifest.styles.get(usize::from(s)));
    let classes = database.classes().map(|c| {
        let [action, style] = export::class_names(&manifest, c);
        json!({
            "action": action, "style": style,
            "frames": c.rows, "searchable": c.searchable, "cycles": c.cycles, "k_cap": c.k_cap,
        })
    });
    Ok(json!({
        "frames": counts.frames,
        "prototype_frames": counts.rows - counts.frames,
        "classes": classes.collect::<Vec<_>>(),
        "joints": counts.joints,
        "dofs": counts.dofs,
        "features": counts.features,
        "window": counts.window,
        "rate_hz": database.rate_hz(),
        "bytes": bytes,
        "plain_bytes": plain,
        "bytes_per_frame": (counts.frames > 0).then(|| plain as f64 / counts.frames as f64),
        "sections": sections,
        "models": models,
        "methods": methods(database),
        "models_from": from(database.linear_from().or(database.statistic_from())),
        "actions": asked_for(&manifest.actions.iter().collect::<Vec<_>>(), database.classes().map(|c| c.action)),
        "styles": asked_for(&manifest.styles.iter().collect::<Vec<_>>(), database.classes().map(|c| c.style)),
        "groups": manifest.groups.iter().collect::<Vec<_>>(),
        "clips": counts.clips,
        "cycles": counts.cycles,
        "outputs_per_cycle": database.outputs(),
        "licences": manifest.licences.iter().collect::<Vec<_>>(),
        "parameters": manifest.parameters.iter().collect::<Vec<_>>(),
        "builder": manifest.builder,
        "effort": database.dial().map(|dial| {
            let mut found = effort(&dial, &manifest.styles.iter().collect::<Vec<_>>());
            found["alike"] = json!(styles_alike(database));
            found["fixed"] = json!(fixed_factors(database));
            found
        }),
    }))
}

/// The names that a class has, of all that the database lists; all, where it holds models and no classes.
fn asked_for<'n>(names: &[&'n str], classes: impl Iterator<Item = u16>) -> Vec<&'n str> {
    let there: BTreeSet<usize> = classes.map(usize::from).collect();
    let is_there = |(i, _): &(usize, &&str)| there.is_empty() || there.contains(i);
    names.iter().enumerate().filter(is_there).map(|(_, name)| *name).collect()
}

/// Range of the effort dial, and whether people gave its labels.
fn effort(dial: &Dial<'_>, styles: &[&str]) -> Value {
    let factors = |values: [f32; 3]| Effort::NAMES.iter().zip(values).collect::<BTreeMap<_, _>>();
    let low = dial.range().map(|r| r.0);
    let high = dial.range().map(|r| r.1);
    let of_styles: BTreeMap<&str, _> =
        styles.iter().enumerate().map(|(s, name)| (*name, factors(dial.of_style(s).factors()))).collect();
    json!({
        "labels": match dial.labels() {
            Labels::Given => "given",
            Labels::Estimated => "estimated",
        },
        "low": factors(low), "high": factors(high), "rest": factors(dial.rest().factors()), "of_styles": of_styles,
    })
}

/// Runs `inspect`.
pub fn inspect(args: &InspectArgs) -> Result<()> {
    let bytes = open::read_blob(&args.db)?;
    let database = open::open(&args.db, &bytes)?;
    let figures = figures(&database, bytes.len())?;
    doubts(&database).iter().for_each(super::note);
    if args.report.json {
        return super::say(&figures);
    }
    let frames = database.counts().frames as f64;
    let a_frame = match figures["bytes_per_frame"].as_f64() {
        Some(bytes) => format!("{bytes:.1} a frame without models"),
        None => "models only".to_owned(),
    };
    super::say(format_args!("{}: verified, {} bytes, {a_frame}", args.db.display(), bytes.len()))?;
    for key in [
        "builder",
        "frames",
        "prototype_frames",
        "rate_hz",
        "joints",
        "dofs",
        "clips",
        "cycles",
        "outputs_per_cycle",
        "actions",
        "styles",
        "classes",
        "groups",
        "methods",
        "licences",
        "parameters",
        "effort",
    ] {
        // The classes have a table of their own below.
        let value = if key == "classes" { &json!(database.counts().classes) } else { &figures[key] };
        super::say(format_args!("  {key:17} {value}"))?;
    }
    super::say(format_args!("  {:17} {:>10} {:>8}", "section", "bytes", "a frame"))?;
    for (id, content) in database.sections().into_iter().chain(database.optional_sections()) {
        let name = section::name(id).unwrap_or("?");
        let a_frame = if section::OPTIONAL.contains(&id) || frames == 0.0 {
            "-".to_owned()
        } else {
            format!("{:.2}", content.len() as f64 / frames)
        };
        super::say(format_args!("  {name:17} {:>10} {a_frame:>8}", content.len()))?;
    }
    let names: Vec<String> =
        classes(&figures).map(|c| format!("{} {}", text(c, "action"), text(c, "style"))).collect();
    let width = names.iter().map(|name| name.chars().count()).max().unwrap_or(0).max(17);
    super::say(format_args!("  {:width$} {:>10} {:>8} {:>8}", "class", "frames", "cycles", "k cap"))?;
    for (name, class) in names.iter().zip(classes(&figures)) {
        let [frames, cycles, cap] = ["frames", "cycles", "k_cap"].map(|key| class[key].to_string());
        super::say(format_args!("  {name:width$} {frames:>10} {cycles:>8} {cap:>8}"))?;
    }
    Ok(())
}

fn classes(figures: &Value) -> impl Iterator<Item = &Value> {
    figures["classes"].as_array().into_iter().flatten()
}

fn text<'v>(value: &'v Value, key: &str) -> &'v str {
    value[key].as_str().unwrap_or("?")
}

/// Runs `export`.
pub fn export(args: &ExportArgs) -> Result<()> {
    let bytes = open::read_blob(&args.db)?;
    let database = open::open(&args.db, &bytes)?;
    if database.counts().frames == 0 {
        anyhow::bail!("{}: it holds models only, and no frames to export", args.db.display());
    }
    open::make_folder(&args.output)?;
    // A file of one of these names may be a link to the database.
    let there = fs::read_dir(&args.output)?.filter_map(|entry| Some(entry.ok()?.path()));
    let arrays: Vec<PathBuf> =
        there.filter(|p| p.extension().is_some_and(|e| e == "npy") || p.ends_with("manifest.json")).collect();
    super::check_outputs([Some(&args.db)], arrays.iter().map(|array| ("-o", Some(array))))?;
    export::export(&database, &args.output)?;
    let frames = database.counts().frames;
    args.report.print(
        || json!({ "frames": frames, "output": super::shown(&args.output) }),
        || format!("{}: {frames} frames as arrays, and manifest.json", args.output.display()),
    )
}
