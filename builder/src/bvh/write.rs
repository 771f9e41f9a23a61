//! From [`Bvh`] to text.

use std::fmt::Write;

use super::Bvh;

impl Bvh {
    /// The file's text: tabs, one frame a line, and as many digits as bring every number back to 1e-6.
    pub fn to_text(&self) -> String {
        let mut text = String::from("HIERARCHY\n");
        // Joints that are still open, deepest last.
        let mut open: Vec<usize> = Vec::new();
        for (index, joint) in self.joints.iter().enumerate() {
            while open.last().copied() != joint.parent {
                close(&mut text, &mut open);
            }
            let indent = "\t".repeat(open.len());
            let keyword = if joint.parent.is_none() { "ROOT" } else { "JOINT" };
            let _ = writeln!(text, "{indent}{keyword} {}\n{indent}{{", joint.name);
            let [x, y, z] = [joint.offset.x, joint.offset.y, joint.offset.z].map(number);
            let _ = writeln!(text, "{indent}\tOFFSET {x} {y} {z}");
            let _ = write!(text, "{indent}\tCHANNELS {}", joint.channels.len());
            for channel in &joint.channels {
                let _ = write!(text, " {}", channel.name());
            }
            text.push('\n');
            if let Some(end) = joint.end_site {
                let [x, y, z] = [end.x, end.y, end.z].map(number);
                let _ = writeln!(
                    text,
                    "{indent}\tEnd Site\n{indent}\t{{\n{indent}\t\tOFFSET {x} {y} {z}\n{indent}\t}}"
                );
            }
            open.push(index);
        }
        while !open.is_empty() {
            close(&mut text, &mut open);
        }
        let _ = writeln!(text, "MOTION\nFrames: {}\nFrame Time: {}", self.frames(), number(self.frame_time));
        for frame in self.values.chunks(self.channels().max(1)) {
            let line: Vec<String> = frame.iter().copied().map(number).collect();
            text.push_str(&line.join(" "));
            text.push('\n');
        }
        text
    }
}

fn close(text: &mut String, open: &mut Vec<usize>) {
    open.pop();
    let _ = writeln!(text, "{}}}", "\t".repeat(open.len()));
}

fn number(value: f64) -> String {
    let text = format!("{value:.8}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}
