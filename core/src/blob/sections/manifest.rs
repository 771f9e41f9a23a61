//! The manifest: names, sources and build parameters for people, in postcard. The stylizer does not read it.

use serde::{Deserialize, Serialize};

/// A list of names in one string, one name a line, which needs no memory for a list.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[serde(transparent)]
pub struct Names<'a>(#[serde(borrow)] pub &'a str);

impl<'a> Names<'a> {
    /// The names in order.
    pub fn iter(self) -> impl Iterator<Item = &'a str> {
        // An empty string is an empty list, not a list of one empty name.
        // A set of one char: the standard library's search for a single char contains a panic.
        self.0.split(['\n']).filter(move |_| !self.0.is_empty())
    }

    /// The name with that number.
    pub fn get(self, index: usize) -> Option<&'a str> {
        self.iter().nth(index)
    }

    /// The number of that name.
    pub fn find(self, name: &str) -> Option<u16> {
        self.iter().position(|n| n == name).and_then(|i| u16::try_from(i).ok())
    }

    /// Number of names.
    #[inline(never)]
    pub fn count(self) -> usize {
        // Counted by bytes, which is faster than `iter`: `open` counts five lists.
        if self.0.is_empty() { 0 } else { 1 + self.0.bytes().filter(|b| *b == b'\n').count() }
    }
}

/// Names, sources and build parameters of a database.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Manifest<'a> {
    /// Name and version of the builder.
    #[serde(borrow)]
    pub builder: &'a str,
    /// Unit of lengths: `m`.
    pub unit: &'a str,
    /// Joints, in the order of the skeleton.
    pub joints: Names<'a>,
    /// Actions, by number.
    pub actions: Names<'a>,
    /// Styles, by number.
    pub styles: Names<'a>,
    /// Joint groups, by number.
    pub groups: Names<'a>,
    /// Clips, in the order of the clip table.
    pub clips: Names<'a>,
    /// Licences and sources of the clips, a line each.
    pub licences: Names<'a>,
    /// Build parameters, `name = value`, a line each.
    pub parameters: Names<'a>,
}

impl<'a> Manifest<'a> {
    /// Reads a manifest in postcard, where a structure is its fields one after the other: all are strings, so that one
    /// loop reads it with a quarter of the code that serde generates for nine fields.
    #[inline]
    pub fn read(mut bytes: &'a [u8]) -> Option<Self> {
        let mut fields = [""; 9];
        for field in &mut fields {
            (*field, bytes) = postcard::take_from_bytes(bytes).ok()?;
        }
        let [builder, unit, joints, actions, styles, groups, clips, licences, parameters] = fields;
        Some(Self {
            builder,
            unit,
            joints: Names(joints),
            actions: Names(actions),
            styles: Names(styles),
            groups: Names(groups),
            clips: Names(clips),
            licences: Names(licences),
            parameters: Names(parameters),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_manifest_is_read_as_serde_writes_it_and_reads_it() {
        let manifest = Manifest {
            builder: "b",
            unit: "m",
            joints: Names("hips\nknee"),
            actions: Names("walk"),
            styles: Names("old\nproud"),
            groups: Names("all"),
            clips: Names(""),
            licences: Names("none"),
            parameters: Names("window = 5"),
        };
        let mut room = [0; 128];
        let bytes = &*postcard::to_slice(&manifest, &mut room).unwrap();
        assert_eq!(Manifest::read(bytes), Some(manifest));
        assert_eq!(postcard::from_bytes::<Manifest<'_>>(bytes).ok(), Some(manifest));
        assert_eq!(Manifest::read(&bytes[..bytes.len() - 1]), None);
    }

    #[test]
    fn count_agrees_with_iter() {
        for names in ["", "a", "a\nb", "\n", "a\n", "\u{e9}\n\nb"] {
            assert_eq!(Names(names).count(), Names(names).iter().count(), "{names:?}");
        }
    }
}
