//! A document as text.
//!
//! Numbers are printed in the shortest form that reads back as the same `f64`: [`Bvh::to_text`] then
//! [`Bvh::parse`] is the identity. Indentation is by tabs, lines end in LF. A frame
//! takes about ten bytes per channel.

use std::fmt::Write;

use crate::formats::bvh::document::{Bvh, Channel, Joint};

impl Bvh {
    /// The document in the BVH format.
    pub fn to_text(&self) -> String {
        let mut text = String::with_capacity(self.joints.len() * 120 + self.values.len() * 11);
        text.push_str("HIERARCHY\n");
        let mut open: Vec<usize> = Vec::new();
        for (index, joint) in self.joints.iter().enumerate() {
            while open.last().copied() != joint.parent {
                open.pop();
                line(&mut text, open.len(), "}");
            }
            head(&mut text, open.len(), joint);
            open.push(index);
        }
        while open.pop().is_some() {
            line(&mut text, open.len(), "}");
        }
        // Writing to a String cannot fail.
        let _ = write!(text, "MOTION\nFrames: {}\nFrame Time: {}\n", self.frames(), self.frame_time_s);
        for row in self.values.chunks_exact(self.channels) {
            for (i, value) in row.iter().enumerate() {
                let _ = write!(text, "{}{value}", if i == 0 { "" } else { " " });
            }
            text.push('\n');
        }
        text
    }
}

fn line(text: &mut String, depth: usize, content: &str) {
    text.extend(std::iter::repeat_n('\t', depth));
    text.push_str(content);
    text.push('\n');
}

/// A joint from its name to its End Sites, without the brace that closes it.
fn head(text: &mut String, depth: usize, joint: &Joint) {
    let word = if joint.parent.is_none() { "ROOT" } else { "JOINT" };
    line(text, depth, &format!("{word} {}", joint.name));
    line(text, depth, "{");
    line(text, depth + 1, &offset(&joint.offset));
    let words: Vec<&str> = joint.channels.iter().map(|c: &Channel| c.word()).collect();
    let list = format!("CHANNELS {} {}", words.len(), words.join(" "));
    line(text, depth + 1, list.trim_end());
    for site in &joint.end_sites {
        line(text, depth + 1, "End Site");
        line(text, depth + 1, "{");
        line(text, depth + 2, &offset(site));
        line(text, depth + 1, "}");
    }
}

fn offset([x, y, z]: &[f64; 3]) -> String {
    format!("OFFSET {x} {y} {z}")
}
