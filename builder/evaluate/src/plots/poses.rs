//! Sheets of drawn poses: stick figures at places of a picture, each with a line of text.

use nalgebra::Vector3;
use plotters::{
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};

use gestus_motion::{body::Body, clip::Frame};

use super::{Area, Drawn, drawn_alone};

/// The camera: turned from the front of the body, and tilted down, radians.
const CAMERA: (f64, f64) = (1.05, 0.12);
/// Radius of a head, metres, and how high it is over its joint.
const HEAD_M: (f64, f64) = (0.09, 0.11);

/// Colours of bodies, as in Xia 2015, Figure 7, and a faint one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ink {
    /// An input.
    Green,
    /// What was found in the database.
    Red,
    /// An output.
    Blue,
    /// For comparison, behind another.
    Faint,
}

impl Ink {
    /// Of the limbs on the right, which is nearer to the eye, and on the left.
    fn colours(self) -> [RGBColor; 2] {
        match self {
            Self::Green => [RGBColor(0, 110, 70), RGBColor(110, 190, 155)],
            Self::Red => [RGBColor(180, 40, 20), RGBColor(232, 150, 130)],
            Self::Blue => [RGBColor(0, 80, 150), RGBColor(125, 180, 225)],
            Self::Faint => [RGBColor(190, 190, 190), RGBColor(222, 222, 222)],
        }
    }
}

/// A pose that is drawn at a place.
#[derive(Debug, Clone)]
pub struct Figure {
    /// Where its hips are over the floor, pixels from the upper left.
    pub at: (i32, i32),
    /// What is drawn there, the hindmost first.
    pub poses: Vec<(Frame, Ink)>,
    /// Under it.
    pub text: Vec<String>,
}

/// A sheet.
#[derive(Debug, Clone)]
pub struct Sheet<'a> {
    /// Heading.
    pub title: &'a str,
    /// Pixels.
    pub size: (u32, u32),
    /// Pixels of a metre of the body.
    pub scale: f64,
    /// Lines behind the figures.
    pub lines: Vec<[(i32, i32); 2]>,
    /// The figures.
    pub figures: Vec<Figure>,
}

/// Draws a sheet of one body as SVG. Each pose stands on the floor by its own height, hips over its place, and keeps its
/// heading: the camera sees a body that faces +Z from its front and right.
pub fn sheet(body: &Body, sheet: &Sheet<'_>) -> String {
    let bones = Bones::of(body);
    drawn_alone(sheet.size, |area| {
        let heading = ("sans-serif", 20).into_font().color(&BLACK).pos(Pos::new(HPos::Left, VPos::Top));
        area.draw(&Text::new(sheet.title.to_owned(), (14, 10), heading))?;
        for line in &sheet.lines {
            area.draw(&PathElement::new(line.to_vec(), RGBColor(205, 205, 205)))?;
        }
        for figure in &sheet.figures {
            for (frame, ink) in &figure.poses {
                bones.draw(area, (figure.at, sheet.scale), &frame.positions(&body.skeleton), *ink)?;
            }
            let style = ("sans-serif", 12).into_font().color(&BLACK).pos(Pos::new(HPos::Center, VPos::Top));
            for (i, text) in figure.text.iter().enumerate() {
                let at = (figure.at.0, figure.at.1 + 14 + 14 * i as i32);
                area.draw(&Text::new(text.clone(), at, style.clone()))?;
            }
        }
        Ok(())
    })
}

/// What is drawn of a skeleton.
struct Bones {
    /// From joint to joint; whether it is on the left. Left ones first, since they are behind.
    bones: Vec<(usize, usize, bool)>,
    head: Option<usize>,
}

impl Bones {
    fn of(body: &Body) -> Self {
        let (skeleton, landmarks) = (&body.skeleton, &body.landmarks);
        let under = |mut joint: usize, ancestor: usize| {
            while joint != ancestor {
                match skeleton.parents[joint] {
                    Some(parent) => joint = parent,
                    None => return false,
                }
            }
            true
        };
        let left = |j: usize| landmarks.groups[j] == 1 || under(j, landmarks.hip_joints[0]);
        let mut bones: Vec<(usize, usize, bool)> =
            (0..skeleton.joints()).filter_map(|j| Some((skeleton.parents[j]?, j, left(j)))).collect();
        bones.sort_by_key(|bone| !bone.2);
        let head = skeleton.names.iter().position(|name| name.to_lowercase().starts_with("head"));
        Self { bones, head }
    }

    fn draw(
        &self,
        area: &Area<'_>,
        (at, scale): ((i32, i32), f64),
        joints: &[Vector3<f64>],
        ink: Ink,
    ) -> Drawn {
        let hips = joints[0];
        let see = |p: &Vector3<f64>| {
            let (turn, tilt) = CAMERA;
            let (x, z) = (p.x - hips.x, p.z - hips.z);
            let across = turn.sin() * z - turn.cos() * x;
            let ahead = turn.cos() * z + turn.sin() * x;
            let up = tilt.cos() * p.y - tilt.sin() * ahead;
            (at.0 + (scale * across).round() as i32, at.1 - (scale * up).round() as i32)
        };
        let [right, left] = ink.colours();
        let wide = if ink == Ink::Faint { 2 } else { 3 };
        for &(from, to, is_left) in &self.bones {
            let style = if is_left { left } else { right }.stroke_width(wide);
            area.draw(&PathElement::new(vec![see(&joints[from]), see(&joints[to])], style))?;
        }
        if let Some(head) = self.head {
            let (radius, over) = HEAD_M;
            let middle = see(&(joints[head] + Vector3::new(0.0, over, 0.0)));
            area.draw(&Circle::new(middle, (scale * radius) as i32, right.stroke_width(wide)))?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use gestus_database::synth;

    use super::*;

    #[test]
    fn a_sheet_has_a_line_for_each_bone_and_the_text_under_it() {
        let corpus = synth::corpus(&synth::Options::of(&["walk"], &["neutral"], 1, 4.0)).unwrap();
        let body = Body::of(&corpus).unwrap();
        let frame = corpus.examples[0].clip.frames[0].clone();
        let of = |poses: Vec<(Frame, Ink)>| Sheet {
            title: "a < b",
            size: (300, 200),
            scale: 80.0,
            lines: vec![[(10, 10), (90, 90)]],
            figures: vec![Figure { at: (150, 180), poses, text: vec!["proud 0.5".into()] }],
        };
        let (none, one) = (sheet(&body, &of(vec![])), sheet(&body, &of(vec![(frame, Ink::Red)])));
        let lines = |svg: &str| svg.matches("<polyline").count() + svg.matches("<line").count();
        assert_eq!(lines(&one) - lines(&none), body.skeleton.joints() - 1);
        assert!(one.contains("proud 0.5") && one.contains("a &lt; b") && !one.contains("NaN"));
        assert_eq!(one.matches("<circle").count(), 1, "the head");
    }
}
