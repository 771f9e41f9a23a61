//! Where Euler angles fail (statistical style transfer, Figure 2): a generated walk with an arm that is held so that its
//! swing passes the pole of its angles. There the first and the last angle turn about one axis, and leap.

use std::f64::consts::FRAC_PI_2;

use gestus_database::{
    build::BuildError,
    models::statistic::transfer::transfer,
    synth::{self, joint},
};
use gestus_motion::{
    body::Body,
    clip::{Clip, Frame},
    euler::about,
};
use serde_json::json;

use super::methods::METHODS;
use crate::{
    evaluation::row,
    metrics::{performance::Performance, speed::speeds, third_difference},
    plots::{self, Labels, Series},
    report::{html::Figure, table},
};

/// The joint whose angles are near their pole, the left upper arm, and the hand at its end.
const ARM: [usize; 2] = [joint::SHOULDER[0] + 1, joint::SHOULDER[0] + 3];

/// A clip's arm.
struct Arm {
    /// How fast the upper arm turns, rad/s. Shape `[frames - 1]`.
    speeds: Vec<f64>,
    /// Mean third difference of the hand's place before the hips.
    third_difference: f64,
}

impl Arm {
    fn of(body: &Body, clip: &Clip) -> Self {
        let [upper, hand] = ARM;
        let place = |frame: &Frame| {
            let positions = frame.positions(&body.skeleton);
            vec![frame.rotations[0].inverse() * (positions[hand] - positions[0])]
        };
        let places: Vec<_> = clip.frames.iter().map(place).collect();
        let all = speeds(&Performance::of_clip(clip, body));
        Self {
            speeds: all.iter().map(|joints| joints[upper]).collect(),
            third_difference: third_difference(&places),
        }
    }

    fn fastest(&self) -> f64 {
        self.speeds.iter().copied().fold(0.0, f64::max)
    }
}

/// A row for each method, and how fast the arm turns in each.
pub(super) fn rows() -> Result<(Vec<table::Row>, Figure), BuildError> {
    let generated = synth::Options::of(&["walk"], &["neutral", "proud"], 1, 6.0);
    // The names above are the generator's own.
    let corpus = synth::corpus(&generated).map_err(|e| BuildError::Unpaired(e.to_string()))?;
    let body = Body::of(&corpus)?;
    let clip = |style: usize| {
        let example = corpus.examples.iter().find(|e| e.style == style);
        example.map(|e| at_pole(&body, &e.clip))
    };
    let (Some(source), Some(reference)) = (clip(0), clip(1)) else { return Ok((Vec::new(), figure(&[]))) };
    let (own, wanted) = (Arm::of(&body, &source), Arm::of(&body, &reference));
    let points = |arm: &Arm| -> Vec<(f64, f64)> {
        arm.speeds.iter().enumerate().map(|(t, &v)| (t as f64 / corpus.rate_hz, v)).collect()
    };
    let mut series: Vec<Series> =
        vec![("source".into(), points(&own)), ("reference".into(), points(&wanted))];
    let mut rows = Vec::new();
    for (method, of) in METHODS {
        let Ok(out) = transfer(&body, &source, &reference, &of()) else { continue };
        let out = Arm::of(&body, &out.clip);
        rows.push(row(json!({
            "part": "singular",
            "method": method,
            "arm_speed_ratio": out.fastest() / own.fastest().max(wanted.fastest()),
            "arm_third_difference": out.third_difference / own.third_difference.max(wanted.third_difference),
        })));
        series.push((method.into(), points(&out)));
    }
    Ok((rows, figure(&series)))
}

/// The clip with an arm whose mean is turned to the pole of its angles, where the middle one is a right angle.
fn at_pole(body: &Body, clip: &Clip) -> Clip {
    let [upper, _] = ARM;
    let mut clip = clip.clone();
    for frame in &mut clip.frames {
        let swing = body.means[upper].inverse() * frame.rotations[upper];
        frame.rotations[upper] = about(0, FRAC_PI_2) * swing;
    }
    clip
}

fn figure(series: &[Series]) -> Figure {
    let labels = Labels {
        title: "An arm whose swing passes the pole of its Euler angles",
        x: "seconds",
        y: "speed of the upper arm, rad/s",
    };
    Figure {
        name: "singular".into(),
        caption: "Statistical style transfer, Figure 2, on generated motion.".into(),
        svg: plots::lines(labels, series),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arm_leaps_with_euler_angles_alone() {
        let (rows, figure) = rows().unwrap();
        let of = |method: &str, key: &str| {
            rows.iter().find(|r| r["method"] == method).unwrap()[key].as_f64().unwrap()
        };
        assert!(of("transfer", "arm_speed_ratio") < 1.3 && of("transfer-literal", "arm_speed_ratio") < 1.3);
        assert!(
            of("transfer-euler", "arm_speed_ratio") > 2.0 * of("transfer", "arm_speed_ratio"),
            "{rows:?}"
        );
        assert!(figure.svg.contains("transfer-euler"));
    }
}
