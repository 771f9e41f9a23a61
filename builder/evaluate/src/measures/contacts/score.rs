//! Agreement of contacts.

/// Counts of agreement over both feet.
#[derive(Debug, Clone, Copy, Default)]
pub struct Score {
    both: f64,
    found: f64,
    true_: f64,
    agreed: f64,
    all: f64,
}

impl Score {
    /// Counts one foot in one frame.
    pub fn add(&mut self, found: bool, truth: bool) {
        let one = |b: bool| f64::from(u8::from(b));
        self.both += one(found && truth);
        self.found += one(found);
        self.true_ += one(truth);
        self.agreed += one(found == truth);
        self.all += 1.0;
    }

    /// Harmonic mean of precision and recall of "stands".
    pub fn f1(&self) -> f64 {
        2.0 * self.both / (self.found + self.true_).max(1.0)
    }

    /// Share of feet and frames that agree.
    pub fn accuracy(&self) -> f64 {
        self.agreed / self.all.max(1.0)
    }
}

/// Agreement of two lists of contacts.
pub(in crate::measures) fn score(found: &[[bool; 2]], truth: &[[bool; 2]]) -> Score {
    let mut score = Score::default();
    for (f, t) in found.iter().zip(truth) {
        score.add(f[0], t[0]);
        score.add(f[1], t[1]);
    }
    score
}

/// How often a foot comes down or up.
pub(in crate::measures) fn changes(contacts: &[[bool; 2]]) -> usize {
    contacts.windows(2).map(|w| (0..2).filter(|&side| w[0][side] != w[1][side]).count()).sum()
}

/// A count over that of the truth; none where the truth has none.
pub(in crate::measures) fn over(found: usize, truth: usize) -> Option<f64> {
    (truth > 0).then(|| found as f64 / truth as f64)
}

/// Contacts and gaps of less than 50 ms, a second.
pub(in crate::measures) fn flickers(contacts: &[[bool; 2]], rate_hz: f64) -> f64 {
    let shortest = (0.05 * rate_hz).ceil() as usize;
    let mut count = 0;
    for side in [0, 1] {
        let mut start = 0;
        for t in 1..contacts.len() {
            if contacts[t][side] != contacts[t - 1][side] {
                count += usize::from(start > 0 && t - start < shortest);
                start = t;
            }
        }
    }
    count as f64 / (contacts.len() as f64 / rate_hz)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scores_count_what_they_say() {
        // Left: two right of three; right: one missed.
        let found = [[true, false], [true, false], [false, false]];
        let truth = [[true, false], [false, true], [false, false]];
        let score = score(&found, &truth);
        assert!((score.f1() - 0.5).abs() < 1e-12);
        assert!((score.accuracy() - 4.0 / 6.0).abs() < 1e-12);
        assert_eq!((changes(&found), changes(&truth)), (1, 3));
    }

    #[test]
    fn one_frame_in_the_air_is_a_flicker_and_a_step_is_none() {
        let mut contacts = vec![[true, true]; 30];
        contacts[10][0] = false;
        contacts[20..25].iter_mut().for_each(|c| c[1] = false);
        assert!((flickers(&contacts, 30.0) - 1.0).abs() < 1e-12);
    }
}
