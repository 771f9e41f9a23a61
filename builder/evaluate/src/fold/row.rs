//! One row of a table: a method's figures in a fold, of its prediction and of the poses that leave.

use gestus_motion::corpus::Corpus;
use serde_json::json;

use crate::{evaluation, metrics::figures::Figures, report::table};

/// One test clip in one style by one method.
#[derive(Debug, Clone)]
pub struct Row {
    /// Name of the method.
    pub method: String,
    /// Action of the test clip.
    pub action: usize,
    /// Output style.
    pub style: usize,
    /// Name of the test clip.
    pub clip: String,
    /// Name of the truth clip.
    pub truth: String,
    /// Of the prediction: before foot lock, stillness and limits.
    pub predicted: Figures,
    /// Of the poses that leave, at the times at which they do. Methods outside the core deliver what they predict.
    pub delivered: Figures,
    /// F1 of standing feet against the truth's; of methods that say which foot stands.
    pub contact_f1: Option<f64>,
    /// Share of the frames that the core flags as unlike the database; of methods that stream.
    pub far: Option<f64>,
    /// Error of another real clip of the style in the same fold, centimetres: what no method has to be better than.
    pub floor_cm: Option<f64>,
}

impl Row {
    /// As a row of a table, the delivered figure before the predicted one.
    pub fn to_json(&self, corpus: &Corpus) -> table::Row {
        let mut row = evaluation::row(json!({
            "method": self.method,
            "action": corpus.actions[self.action],
            "style": corpus.styles[self.style],
            "clip": self.clip,
            "truth": self.truth,
        }));
        row.extend(self.measured());
        row
    }

    /// The figures alone, by name.
    pub fn measured(&self) -> table::Row {
        let (p, d) = (&self.predicted, &self.delivered);
        let error = |f: &Figures| f.duration.map(|d| (d - 1.0).abs());
        evaluation::row(json!({
            "delivered_error_cm": d.error_cm,
            "joint_error_cm": p.error_cm,
            "delivered_over_floor": self.floor_cm.map(|floor| d.error_cm / floor),
            "delivered_speed": d.speed,
            "speed": p.speed,
            "delivered_variability": d.variability,
            "variability": p.variability,
            "delivered_amplitude": d.amplitude,
            "amplitude": p.amplitude,
            "delivered_third_difference": d.third_difference,
            "third_difference": p.third_difference,
            "delivered_step_error_ms": d.step_error_ms,
            "step_error_ms": p.step_error_ms,
            "delivered_duration": d.duration,
            "duration": p.duration,
            "delivered_duration_error": error(d),
            "duration_error": error(p),
            "delivered_skate_counterpart_cm_s": d.skate_counterpart_cm_s,
            "skate_counterpart_cm_s": p.skate_counterpart_cm_s,
            "delivered_skate_stillest_cm_s": d.skate_stillest_cm_s,
            "skate_stillest_cm_s": p.skate_stillest_cm_s,
            "contact_f1": self.contact_f1,
            "far": self.far,
        }))
    }
}
