//! The retimer and the cap on visits cannot panic: poses at any rate and in any order, ticks at any time, and any clock.

use gestus_core::{
    Pose,
    output::{
        retime::{Bounds, Retimer},
        visit_cap::VisitCap,
    },
};

/// Pushes and ticks with arbitrary numbers.
#[inline(never)]
pub fn reach(numbers: &[u32; 32], floats: &[f32; 256]) -> u32 {
    capped(numbers) ^ retimed::<22, 8>(numbers, floats) ^ retimed::<64, 48>(numbers, floats)
}

#[inline(never)]
fn retimed<const J: usize, const N: usize>(numbers: &[u32; 32], floats: &[f32; 256]) -> u32 {
    let bounds = if numbers[0] == 1 { Bounds::SYNC } else { Bounds { lead_s: floats[0], lag_s: floats[1] } };
    let Ok(mut retimer) = Retimer::<J, N>::new(numbers[1], numbers[2], bounds) else { return 1 };
    let (mut input, mut output) = (Pose::<J>::IDENTITY, Pose::<J>::IDENTITY);
    let mut sum = retimer.latency_s().to_bits();
    for (step_s, &what) in floats.iter().zip(numbers.iter().cycle()) {
        for (value, &float) in
            input.position.iter_mut().chain(input.rotations.as_flattened_mut()).zip(floats.iter().cycle())
        {
            *value = float + step_s;
        }
        match what {
            0 => retimer.reset(),
            1 => retimer.push(&input, *step_s),
            _ => {
                let tick = retimer.tick(&mut output);
                sum ^= tick.speed.to_bits() ^ tick.lag_s.to_bits() ^ u32::from(tick.waited);
                sum ^= output.rotations.as_flattened().iter().fold(0, |sum, r| sum ^ r.to_bits());
            }
        }
        sum ^= u32::from(retimer.is_due()) ^ retimer.lag_s().to_bits();
    }
    sum ^ output.position[0].to_bits()
}

#[inline(never)]
fn capped(numbers: &[u32; 32]) -> u32 {
    let Ok(mut cap) = VisitCap::new(numbers[3], numbers[4] as u16) else { return 1 };
    let visits: u32 = numbers.iter().map(|&ticks| u32::from(cap.after(ticks))).sum();
    visits ^ u32::from(cap.visits()) ^ cap.missed()
}
