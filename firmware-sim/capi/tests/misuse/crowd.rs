//! `gestus_step_many`: what it refuses, and that it does what one step after the other does.

use std::ptr;

use gestus::{crowd::*, status::GestusStatus as S, stylizer::*};

use super::{Fixture, JOINTS, Table, off};

const COUNT: usize = 2;

/// Poses of a crowd: positions, then rotations, a joint of which turns.
struct Poses {
    positions: [[f32; 3]; COUNT],
    rotations: [[[f32; 4]; JOINTS]; COUNT],
}

impl Poses {
    fn of(frame: usize) -> Self {
        let mut poses = Self {
            positions: [[0.0, 0.9, 0.02 * frame as f32]; COUNT],
            rotations: [[[0.0, 0.0, 0.0, 1.0]; JOINTS]; COUNT],
        };
        for (character, rotations) in poses.rotations.iter_mut().enumerate() {
            let half = 0.1 * (frame as f32 * 0.4 + character as f32).sin();
            rotations[5] = [half.sin(), 0.0, 0.0, half.cos()];
        }
        poses
    }
}

#[test]
fn a_crowd_moves_as_its_characters_do_alone() {
    let [alone, together] = [(); 2].map(|()| [Fixture::new(), Fixture::new()]);
    let handles = [together[0].stylizer, together[1].stylizer];
    for frame in 0..20 {
        let mut own = Poses::of(frame);
        let mut reports: [GestusReport; COUNT] = std::array::from_fn(|_| GestusReport::default());
        let mut steps = [0.0; COUNT];
        for (i, fixture) in alone.iter().enumerate() {
            let mut report = GestusReport::default();
            let (p, r) = (own.positions[i].as_mut_ptr(), own.rotations[i].as_mut_ptr().cast());
            // SAFETY: the arrays have as many numbers.
            let answer = unsafe { gestus_stylizer_step(fixture.stylizer, p, r, JOINTS, p, r, &mut report) };
            assert_eq!(answer, S::Ok);
            steps[i] = report.step_s;
        }
        let mut all = Poses::of(frame);
        let (p, r) = (all.positions.as_mut_ptr().cast::<f32>(), all.rotations.as_mut_ptr().cast::<f32>());
        let crowd = GestusCrowd {
            stylizers: handles.as_ptr(),
            count: COUNT,
            positions: p,
            rotations: r,
            joints: JOINTS,
            out_positions: p,
            out_rotations: r,
            reports: reports.as_mut_ptr(),
        };
        let mut stepped = 0;
        // SAFETY: the arrays have as many places.
        assert_eq!(unsafe { gestus_step_many(&crowd, &mut stepped) }, S::Ok);
        assert_eq!(stepped, COUNT);
        assert_eq!((all.positions, all.rotations), (own.positions, own.rotations), "frame {frame}");
        assert_eq!(reports.map(|r| r.step_s), steps);
    }
}

#[test]
fn stepping_many() {
    let mut table = Table::default();
    let fixtures = [Fixture::new(), Fixture::new()];
    let mut handles = fixtures.each_ref().map(|f| f.stylizer);
    let (mut input, mut output) = (Poses::of(0), Poses::of(0));
    let mut reports: [GestusReport; COUNT] = std::array::from_fn(|_| GestusReport::default());
    let h = handles.as_mut_ptr();
    let (p, r) = (input.positions.as_mut_ptr().cast::<f32>(), input.rotations.as_mut_ptr().cast::<f32>());
    let (op, or) = (output.positions.as_mut_ptr().cast::<f32>(), output.rotations.as_mut_ptr().cast::<f32>());
    let (g, mut stepped) = (reports.as_mut_ptr(), 7);
    let n: *mut usize = &mut stepped;
    let inside = |i: usize| fixtures[i].stylizer.wrapping_byte_add(64);
    let blob = |i: usize| -> *mut f32 {
        let bytes = &fixtures[i].blob;
        bytes.as_ptr().wrapping_add(bytes.as_ptr().align_offset(8)).cast_mut().cast()
    };
    let right = || GestusCrowd {
        stylizers: h,
        count: COUNT,
        positions: p,
        rotations: r,
        joints: JOINTS,
        out_positions: op,
        out_rotations: or,
        reports: g,
    };
    let mut one = right();
    let crowds: [(&str, GestusCrowd, S); 21] = [
        ("no handles", GestusCrowd { stylizers: ptr::null(), ..right() }, S::Null),
        ("no positions", GestusCrowd { positions: ptr::null(), ..right() }, S::Null),
        ("no rotations", GestusCrowd { rotations: ptr::null(), ..right() }, S::Null),
        ("nowhere for positions", GestusCrowd { out_positions: ptr::null_mut(), ..right() }, S::Null),
        ("nowhere for rotations", GestusCrowd { out_rotations: ptr::null_mut(), ..right() }, S::Null),
        ("handles misaligned", GestusCrowd { stylizers: off(h), ..right() }, S::Misaligned),
        ("positions misaligned", GestusCrowd { positions: off(p), ..right() }, S::Misaligned),
        ("reports misaligned", GestusCrowd { reports: off(g), ..right() }, S::Misaligned),
        ("a joint too few", GestusCrowd { joints: JOINTS - 1, ..right() }, S::Short),
        ("more than there is memory", GestusCrowd { count: usize::MAX / 2, ..right() }, S::Short),
        ("joints beyond the address space", GestusCrowd { joints: usize::MAX / 2, ..right() }, S::Short),
        (
            "output between two inputs",
            GestusCrowd { out_positions: p.wrapping_add(3), ..right() },
            S::Overlap,
        ),
        ("output in the other output", GestusCrowd { out_positions: or, ..right() }, S::Overlap),
        ("output in the other input", GestusCrowd { out_positions: r, ..right() }, S::Overlap),
        (
            "output in the first stylizer",
            GestusCrowd { out_positions: inside(0).cast(), ..right() },
            S::Overlap,
        ),
        (
            "output in the second stylizer",
            GestusCrowd { out_rotations: inside(1).cast(), ..right() },
            S::Overlap,
        ),
        ("reports in the second stylizer", GestusCrowd { reports: inside(1).cast(), ..right() }, S::Overlap),
        ("output in the second blob", GestusCrowd { out_positions: blob(1), ..right() }, S::Overlap),
        ("output in the handles", GestusCrowd { out_positions: h.cast(), ..right() }, S::Overlap),
        ("reports in the input", GestusCrowd { reports: r.cast(), ..right() }, S::Overlap),
        ("nobody", GestusCrowd { count: 0, ..right() }, S::Ok),
    ];
    let cases = crowds.len();
    for (case, crowd, expected) in crowds {
        // SAFETY: the misuse is of a kind that the function checks before it follows the pointer.
        let answer = unsafe { gestus_step_many(&crowd, n) };
        table.case("gestus_step_many", case, answer, expected);
        if expected != S::Ok {
            // SAFETY: it is a number of this function.
            assert_eq!(unsafe { n.read() }, 7, "{case}: an array is at fault, so that nobody has stepped");
        }
    }
    try_all! { table, gestus_step_many,
        "no crowd": (ptr::null(), n) => S::Null;
        "crowd misaligned": (off(&raw mut one), n) => S::Misaligned;
        "answer misaligned": (&right(), off(n)) => S::Misaligned;
        "answer in the handles": (&right(), h.cast()) => S::Overlap;
        "without an answer": (&right(), ptr::null_mut()) => S::Ok;
        "as it should be": (&right(), n) => S::Ok;
    }
    // SAFETY: it is a number of this function.
    assert_eq!(unsafe { n.read() }, COUNT);
    // SAFETY: one of two handles, in a place of this function.
    unsafe { h.add(1).write(fixtures[1].database.cast()) };
    try_all! { table, gestus_step_many,
        "a database for the second": (&right(), n) => S::Handle;
    }
    // SAFETY: as above.
    assert_eq!(unsafe { n.read() }, 1, "the first has stepped");
    table.end(cases + 7);
}
