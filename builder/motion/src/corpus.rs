//! Registered clips: all at the database's rate, each with its action, style, contacts and canonical timeline.

use std::sync::Arc;

use thiserror::Error;

use crate::clip::{Clip, Skeleton};

/// A cycle or whole-clip action: the clip's frame at uniform steps of canonical time.
///
/// `knots[i]` is the fractional frame index at phase `i / (knots.len() - 1)`: two knots are a straight line,
/// three a gait cycle from left strike by right strike to left strike. Strictly ascending, at least two.
#[derive(Debug, Clone, PartialEq)]
pub struct Cycle {
    /// Fractional frame indices at uniform phases 0 to 1.
    pub knots: Vec<f64>,
}

impl Cycle {
    /// Frame position at that phase; linear between the knots, extrapolated with the outer slopes.
    pub fn position(&self, phase: f64) -> f64 {
        let segments = self.knots.len() - 1;
        let u = phase * segments as f64;
        let i = (u.floor().max(0.0) as usize).min(segments - 1);
        self.knots[i] + (u - i as f64) * (self.knots[i + 1] - self.knots[i])
    }

    /// Phase at that frame position: the inverse of [`position`](Self::position).
    pub fn phase(&self, position: f64) -> f64 {
        let segments = self.knots.len() - 1;
        let i = self.knots[1..segments].iter().take_while(|&&k| k <= position).count();
        let span = self.knots[i + 1] - self.knots[i];
        (i as f64 + (position - self.knots[i]) / span) / segments as f64
    }

    /// First and last knot.
    pub fn span(&self) -> (f64, f64) {
        (self.knots[0], self.knots[self.knots.len() - 1])
    }
}

/// A clip with its labels, contacts and timeline.
#[derive(Debug, Clone)]
pub struct Example {
    /// The motion, at the corpus's rate, on the corpus's skeleton.
    pub clip: Clip,
    /// Index of its action.
    pub action: usize,
    /// Index of its style.
    pub style: usize,
    /// Name of its take; clips of one take show the same content in different styles. Empty if unknown.
    pub take: String,
    /// Which foot stands, left and right. Shape `[frames]`.
    pub contacts: Vec<[bool; 2]>,
    /// Its canonical timeline: cycles in order of time, not overlapping.
    pub cycles: Vec<Cycle>,
    /// Licence or source, for the manifest; empty if unknown.
    pub licence: String,
}

/// Everything a database is built from.
#[derive(Debug, Clone)]
pub struct Corpus {
    /// Skeleton of every clip.
    pub skeleton: Arc<Skeleton>,
    /// Frames a second of every clip.
    pub rate_hz: f64,
    /// Names of the actions, by index.
    pub actions: Vec<String>,
    /// Names of the styles, by index.
    pub styles: Vec<String>,
    /// The clips.
    pub examples: Vec<Example>,
}

/// An unknown action or style.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("there is no {what} `{name}`: there are {}", have.join(", "))]
pub struct Unknown {
    /// `action` or `style`.
    pub what: &'static str,
    /// The unknown name.
    pub name: String,
    /// The known names.
    pub have: Vec<String>,
}

fn find(what: &'static str, names: &[String], name: &str) -> Result<usize, Unknown> {
    let unknown = || Unknown { what, name: name.to_owned(), have: names.to_vec() };
    names.iter().position(|n| n == name).ok_or_else(unknown)
}

impl Corpus {
    /// A corpus of one clip without labels, contacts or cycles: enough to measure its body.
    pub fn of_clip(clip: &Clip) -> Corpus {
        let example = Example {
            clip: clip.clone(),
            action: 0,
            style: 0,
            take: String::new(),
            contacts: vec![[false; 2]; clip.frames.len()],
            cycles: Vec::new(),
            licence: String::new(),
        };
        Corpus {
            skeleton: clip.skeleton.clone(),
            rate_hz: clip.rate_hz,
            actions: vec![String::new()],
            styles: vec![String::new()],
            examples: vec![example],
        }
    }

    /// The number of the action of that name.
    ///
    /// # Errors
    /// [`Unknown`] where there is none.
    pub fn action(&self, name: &str) -> Result<usize, Unknown> {
        find("action", &self.actions, name)
    }

    /// The number of the style of that name.
    ///
    /// # Errors
    /// [`Unknown`] where there is none.
    pub fn style(&self, name: &str) -> Result<usize, Unknown> {
        find("style", &self.styles, name)
    }

    /// The neutral style: the one called `normal` or `neutral`, in small or capital letters, or else the first.
    pub fn plain_style(&self) -> usize {
        let called = |name: &&str| self.styles.iter().position(|style| style.eq_ignore_ascii_case(name));
        ["normal", "neutral"].iter().find_map(called).unwrap_or(0)
    }

    /// Reorders actions and styles; those not listed follow in alphabetical order.
    pub fn order(&mut self, actions: &[String], styles: &[String]) {
        let sorted = |names: &[String], wanted: &[String]| {
            let place = |n: &String| wanted.iter().position(|w| w == n).unwrap_or(wanted.len());
            let mut order: Vec<usize> = (0..names.len()).collect();
            order.sort_by_key(|&i| (place(&names[i]), names[i].clone()));
            order
        };
        let (a, s) = (sorted(&self.actions, actions), sorted(&self.styles, styles));
        let place = |order: &[usize], old: usize| order.iter().position(|&o| o == old).unwrap_or(0);
        for example in &mut self.examples {
            example.action = place(&a, example.action);
            example.style = place(&s, example.style);
        }
        self.actions = a.iter().map(|&i| self.actions[i].clone()).collect();
        self.styles = s.iter().map(|&i| self.styles[i].clone()).collect();
    }

    /// The corpus without some of its clips.
    pub fn without(&self, left_out: &[usize]) -> Corpus {
        let kept = self.examples.iter().enumerate().filter(|(i, _)| !left_out.contains(i));
        Corpus { examples: kept.map(|(_, e)| e.clone()).collect(), ..self.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_neutral_style_may_be_a_capital_one() {
        let clip = Clip {
            name: String::new(),
            skeleton: Arc::new(Skeleton { names: Vec::new(), parents: Vec::new(), offsets: Vec::new() }),
            rate_hz: 30.0,
            frames: Vec::new(),
        };
        let of = |styles: [&str; 3]| {
            Corpus { styles: styles.map(str::to_owned).to_vec(), ..Corpus::of_clip(&clip) }.plain_style()
        };
        assert_eq!(of(["Elderly", "Normal", "Proud"]), 1);
        assert_eq!(of(["elderly", "neutral", "normal"]), 2);
        assert_eq!(of(["elderly", "proud", "sad"]), 0);
    }

    #[test]
    fn phase_inverts_position() {
        let cycle = Cycle { knots: vec![3.0, 10.0, 31.0] };
        for phase in [-0.1, 0.0, 0.2, 0.5, 0.7, 1.0, 1.2] {
            assert!((cycle.phase(cycle.position(phase)) - phase).abs() < 1e-12, "{phase}");
        }
        assert_eq!(cycle.position(0.5), 10.0);
    }
}
