//! A line to a board in this process, with faults on request. Its time is virtual, so that timeouts cost no time.

use std::{collections::VecDeque, io, time::Duration};

use super::{
    line::Line,
    noise::{FaultCounts, FaultInjector, Noise},
};

/// Transmission time of a byte: 10 bits at 921,600 baud.
const BYTE: Duration = Duration::from_nanos(10_850);
/// Time in which the board handles a request.
const WORK: Duration = Duration::from_millis(1);

/// A line to a board that is a function: it takes a byte and may return a reply.
pub struct Loopback<B> {
    board: B,
    now: Duration,
    /// Bytes in transit with their arrival times, in order: a line never reorders bytes.
    to_board: VecDeque<(Duration, u8)>,
    to_host: VecDeque<(Duration, u8)>,
    injectors: [FaultInjector; 2],
}

impl<B: FnMut(u8) -> Option<Vec<u8>>> Loopback<B> {
    /// A line to that board, with these faults in both directions.
    pub fn new(board: B, noise: Noise) -> Self {
        Self {
            board,
            now: Duration::ZERO,
            to_board: VecDeque::new(),
            to_host: VecDeque::new(),
            injectors: [0, 1].map(|direction| FaultInjector::new(noise, direction)),
        }
    }

    /// The faults injected on the way to the board, and on the way back.
    pub fn fault_counts(&self) -> [FaultCounts; 2] {
        self.injectors.each_ref().map(|injector| injector.counts)
    }

    /// The board takes its next byte.
    fn step_board(&mut self) {
        let Some((time, byte)) = self.to_board.pop_front() else { return };
        if let Some(reply) = (self.board)(byte) {
            let (bytes, late) = self.injectors[1].inject(&reply);
            enqueue(&mut self.to_host, &bytes, time + WORK + late);
        }
    }
}

fn enqueue(queue: &mut VecDeque<(Duration, u8)>, bytes: &[u8], from: Duration) {
    let mut at = queue.back().map_or(from, |(last, _)| from.max(*last));
    for &byte in bytes {
        at += BYTE;
        queue.push_back((at, byte));
    }
}

impl<B: FnMut(u8) -> Option<Vec<u8>>> Line for Loopback<B> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        let (bytes, late) = self.injectors[0].inject(bytes);
        enqueue(&mut self.to_board, &bytes, self.now + late);
        Ok(())
    }

    fn receive(&mut self, into: &mut [u8], within: Duration) -> io::Result<usize> {
        let until = self.now + within;
        // The board runs first if both are due: its reply can't arrive before it.
        loop {
            let host = self.to_host.front().map(|(time, _)| *time);
            match self.to_board.front() {
                Some((time, _)) if *time <= until && host.is_none_or(|host| *time <= host) => {
                    self.step_board()
                }
                _ => break,
            }
        }
        let Some((time, _)) = self.to_host.front().filter(|(time, _)| *time <= until) else {
            self.now = until;
            return Ok(0);
        };
        self.now = self.now.max(*time);
        let mut count = 0;
        for slot in into {
            match self.to_host.front() {
                Some((time, byte)) if *time <= self.now => *slot = *byte,
                _ => break,
            }
            self.to_host.pop_front();
            count += 1;
        }
        Ok(count)
    }

    fn now(&self) -> Duration {
        self.now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn echo(byte: u8) -> Option<Vec<u8>> {
        (byte == 0).then(|| vec![7, 8, 9])
    }

    #[test]
    fn bytes_take_their_time() {
        let mut line = Loopback::new(echo, Noise::default());
        line.send(&[1, 2, 0]).expect("no fault");
        let mut buffer = [0; 8];
        assert_eq!(line.receive(&mut buffer, Duration::from_micros(900)).expect("no fault"), 0);
        assert_eq!(line.now(), Duration::from_micros(900));
        let mut received: Vec<u8> = vec![];
        while received.len() < 3 {
            let count = line.receive(&mut buffer, Duration::from_secs(1)).expect("no fault");
            received.extend(&buffer[..count]);
        }
        assert_eq!(received, [7, 8, 9]);
        assert_eq!(line.now(), WORK + 6 * BYTE);
        assert_eq!(line.receive(&mut buffer, Duration::from_secs(1)).expect("no fault"), 0);
        assert_eq!(line.now(), WORK + 6 * BYTE + Duration::from_secs(1));
    }

    #[test]
    fn what_is_late_delays_what_comes_behind() {
        let noise = Noise { delay: 1.0, delay_ms: 50, seed: 1, ..Noise::default() };
        let mut line = Loopback::new(|b| Some(vec![b]), noise);
        for byte in 1..=20 {
            line.send(&[byte]).expect("no fault");
        }
        let (mut received, mut buffer) = (vec![], [0; 1]);
        while line.receive(&mut buffer, Duration::from_secs(1)).expect("no fault") > 0 {
            received.push(buffer[0]);
        }
        assert_eq!(received, (1..=20).collect::<Vec<u8>>());
        assert_eq!(line.fault_counts().map(|c| c.delayed_frames), [20, 20]);
    }
}
