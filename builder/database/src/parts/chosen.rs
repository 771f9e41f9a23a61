//! What was chosen for a part ([`choose`](super::choose)), also in words and as JSON.

use gestus_core::Method;
use serde_json::{Value, json};

use super::{
    estimate::{Estimate, Fit},
    table::Part,
};

/// A cost of condensing beyond which phase tables, which are made of all cycles, are advised: they lose 2% on walks and
/// runs of `bandai-namco-2`.
const HIGH_COST_PERCENT: f64 = 5.0;

/// The time of a method on the part.
#[derive(Debug, Clone)]
pub struct Timed {
    /// The method.
    pub method: Method,
    /// Whether the input's action and style are given.
    pub labelled: bool,
    /// The estimate for the clip whose slowest frame takes longest.
    pub estimate: Estimate,
    /// The clip's name, action, style and output style.
    pub input: [String; 4],
    /// Whether the database that was chosen holds the method.
    pub is_held: bool,
}

impl Timed {
    /// True if even the slowest frame is done in time.
    pub fn keeps(&self, fps: f64) -> bool {
        self.estimate.worst.frames_per_second()[1] >= fps
    }

    /// The method in words.
    pub fn name(&self) -> String {
        format!("{}{}", self.method.name(), if self.labelled { ", labelled" } else { "" })
    }
}

/// What was chosen, and what it costs.
#[derive(Debug)]
pub struct Chosen {
    /// The name by which the part was asked for.
    pub board: String,
    /// Frames a second that were wanted.
    pub fps: f64,
    /// Every method that was timed, in the order of [`CANDIDATES`](super::choose::CANDIDATES).
    pub timed: Vec<Timed>,
    /// Index of the one that was chosen.
    pub index: usize,
    /// J, K and C of the stylizer.
    pub capacities: [usize; 3],
    /// Bytes of the whole database.
    pub whole_bytes: u64,
    /// Whether the frames were left out.
    pub models_only: bool,
    /// How much larger the error of `mar` is than with the whole database, percent; `None` without frames, and where it is
    /// unknown.
    pub error_cost_percent: Option<f64>,
}

impl Chosen {
    /// The method that was chosen.
    pub fn timed(&self) -> &Timed {
        &self.timed[self.index]
    }

    /// Phase tables where they are held, keep the time, and are nearer than `mar` in a database that is condensed so far.
    pub fn advised(&self) -> Option<&Timed> {
        let costs_much = self.error_cost_percent > Some(HIGH_COST_PERCENT);
        self.timed.iter().find(|t| costs_much && t.method == Method::Phase && t.is_held && t.keeps(self.fps))
    }

    /// What the database needs and what the part has.
    pub fn fit(&self) -> &Fit {
        &self.timed().estimate.fit
    }

    /// The part.
    pub fn part(&self) -> &'static Part {
        self.timed().estimate.part
    }

    /// The figures as JSON.
    pub fn json(&self) -> Value {
        let (fit, timed, part) = (self.fit(), self.timed(), self.part());
        let [j, k, c] = self.capacities;
        json!({
            "board": self.board,
            "part": part.name,
            "core": part.core.name(),
            "fps": self.fps,
            "place": fit.place.name(),
            "bytes_limit": fit.place.room(part),
            "bytes": fit.blob_bytes,
            "whole_bytes": self.whole_bytes,
            "models_only": self.models_only,
            "error_cost_percent": self.error_cost_percent,
            "ram_bytes": fit.ram_needed,
            "ram_limit": fit.ram_bytes,
            "state_bytes": fit.state_bytes,
            "joints": j,
            "k": k,
            "classes": c,
            "stylizer": self.stylizer(),
            "method": timed.method.name(),
            "labelled": timed.labelled,
            "advised": self.advised().map(Timed::name),
            "methods": self.timed.iter().map(|t| self.json_of(t)).collect::<Vec<_>>(),
        })
    }

    fn json_of(&self, timed: &Timed) -> Value {
        let [median, worst] = [timed.estimate.median, timed.estimate.worst];
        let [input, action, style, to] = &timed.input;
        json!({
            "method": timed.method.name(),
            "labelled": timed.labelled,
            "is_held": timed.is_held,
            "keeps": timed.keeps(self.fps),
            "median_ms": 1e3 * median.seconds[1],
            "worst_ms": 1e3 * worst.seconds[1],
            "fps": worst.frames_per_second()[1],
            "fps_median": median.frames_per_second()[1],
            "input": input,
            "action": action,
            "input_style": style,
            "style": to,
        })
    }

    /// What was chosen, line by line; `db` is the database's file.
    pub fn lines(&self, db: &str) -> Vec<String> {
        let (fit, timed, part) = (self.fit(), self.timed(), self.part());
        let asked = if self.board == part.name { String::new() } else { format!("{}: ", self.board) };
        let mut lines = vec![
            format!(
                "{asked}{} ({}, {} MHz) keeps {} frames a second by `--method {}`{}",
                part.name,
                part.core.name(),
                part.clock_mhz,
                self.fps,
                timed.method.name(),
                match timed.method {
                    _ if timed.labelled => " if the input's action and style are given".to_owned(),
                    Method::Lti => format!(" for input in the style {}", timed.input[2]),
                    _ => String::new(),
                },
            ),
            self.memory_line(),
            format!(
                "  RAM: {} of {} bytes; the stylizer, {}, takes {}",
                fit.ram_needed,
                fit.ram_bytes,
                self.stylizer(),
                fit.state_bytes
            ),
            "  estimated, not measured, milliseconds a frame and frames a second:".to_owned(),
            format!("    {:<14} {:>16} {:>17}", "", "slowest frame", "median frame"),
        ];
        lines.extend(self.timed.iter().map(|t| self.row(t)));
        lines.extend(self.use_lines(db));
        lines
    }

    fn stylizer(&self) -> String {
        let [j, k, c] = self.capacities;
        format!("Stylizer<{j}, {k}, {c}>")
    }

    fn memory_line(&self) -> String {
        let (fit, part) = (self.fit(), self.part());
        let kept = if self.models_only {
            format!("without frames, with which it has {} bytes", self.whole_bytes)
        } else if fit.blob_bytes == self.whole_bytes {
            "whole".to_owned()
        } else {
            format!("condensed from {}", self.whole_bytes)
        };
        let optional = if fit.place.is_always_there(part) { "" } else { ", which your board may lack" };
        format!(
            "  database: {} of {} bytes of {} beside the code{optional}; {kept}",
            fit.blob_bytes,
            fit.place.room(part),
            fit.place.name(),
        )
    }

    fn row(&self, timed: &Timed) -> String {
        let [median, worst] = [timed.estimate.median, timed.estimate.worst];
        let said = match (timed.is_held, timed.keeps(self.fps), median.frames_per_second()[1] >= self.fps) {
            (false, ..) => "  too slow, left out",
            (true, false, false) => "  too slow",
            (true, false, true) => "  too slow where a stream begins or leaps",
            (true, true, _) => "",
        };
        format!(
            "    {:<14} {:>8.2} {:>7.1} {:>9.2} {:>7.1}{said}",
            timed.name(),
            1e3 * worst.seconds[1],
            worst.frames_per_second()[1],
            1e3 * median.seconds[1],
            median.frames_per_second()[1],
        )
    }

    fn use_lines(&self, db: &str) -> Vec<String> {
        let timed = self.timed();
        let [clip, action, style, to] = &timed.input;
        let mut lines =
            vec![format!("  of the clips that were tried, {clip} ({action}, {style}) took longest")];
        let labels =
            if timed.labelled { format!(" --action {action} --input-style {style}") } else { String::new() };
        let method = timed.method.name();
        if timed.labelled {
            let other = self.timed.iter().find(|t| t.is_held && !t.labelled && t.keeps(self.fps));
            lines.extend(other.map(|t| {
                format!("  where they are unknown, `--method {}` keeps the time too", t.method.name())
            }));
        }
        if let (Some(advised), Some(cost)) = (self.advised(), self.error_cost_percent) {
            lines.push(format!(
                "  walks and runs: use `--method {}` instead. It loses some 2% at any size, mar {cost:.1}% at this one, and \
                 keeps {} frames a second too ({:.1} in its slowest frame{})",
                advised.method.name(),
                self.fps,
                advised.estimate.worst.frames_per_second()[1],
                if advised.labelled { ", with action and style given" } else { "" },
            ));
        }
        lines.push(format!(
            "  try it: gestus translate --db {db} --input CLIP --style {to} --method {method}{labels} -o OUT"
        ));
        lines.push(format!(
            "  check it: gestus-sim run --db {db} --input CLIP --style {to} --method {method}{labels} --board {}",
            self.part().name
        ));
        lines.push(format!(
            "  in firmware: {}::new(database, Config::new().method(Method::{:?}))?.stylizer(){}",
            // The `Result` of `Stylizer::new` would take the stylizer's RAM a second time.
            self.stylizer().replacen("Stylizer<", "Fit::<", 1),
            timed.method,
            if timed.labelled { ", set_labels" } else { "" }
        ));
        lines
    }
}
