//! A step allocates nothing: the host's allocator counts allocations, and the count does not change.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
};

use gestus_core::{Config, Database, Method, Observer, Pose, Stylizer};
use gestus_database::stream::to_pose;
use gestus_tests::motion;

thread_local! {
    // Constant, so that counting does not allocate; thread-local, so that other tests are not counted.
    static TAKEN: Cell<usize> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: every call is forwarded to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        TAKEN.with(|taken| taken.set(taken.get() + 1));
        // SAFETY: the caller keeps the contract of `alloc`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn taken_by(run: impl FnOnce()) -> usize {
    let before = TAKEN.with(Cell::get);
    run();
    TAKEN.with(Cell::get) - before
}

#[test]
fn the_count_counts() {
    assert!(taken_by(|| drop(std::hint::black_box(vec![1u8; 100]))) > 0);
}

#[test]
fn opening_making_and_stepping_take_nothing() {
    struct Looks(u32);
    impl Observer<22> for Looks {
        fn searched(&mut self, _: usize, found: &gestus_core::search::found::Found<'_>) {
            self.0 += found.rows().len() as u32;
        }
    }
    let blob = motion::large();
    let mut poses: Vec<Pose<22>> = motion::unseen(0, 0, 90).frames.iter().map(to_pose).collect();
    // Also cover a jump and an invalid pose.
    poses.extend(motion::unseen(1, 2, 30).frames.iter().map(to_pose::<22>));
    poses[50].position[0] = f32::NAN;
    for method in Method::ALL {
        let mut looks = Looks(0);
        let taken = taken_by(|| {
            let database = Database::open(blob).unwrap();
            let config = Config::new().method(method).halflife_s(1.0);
            let mut stylizer = Stylizer::<22, 40, 28>::new(database, config).unwrap();
            let mut output = Pose::IDENTITY;
            for (t, pose) in poses.iter().enumerate() {
                if t == 20 {
                    stylizer.set_style(&[(0, 1.0), (2, 1.0)]).unwrap();
                    stylizer.set_action(Some(0)).unwrap();
                }
                if t == 40 {
                    stylizer.set_action(None).unwrap();
                    stylizer.set_mask(1, false).unwrap();
                    stylizer.set_strength(2, 0.5).unwrap();
                    assert!(stylizer.set_style(&[(99, 1.0)]).is_err());
                }
                if t == 100 {
                    stylizer.reset();
                }
                let _ = if t % 2 == 0 {
                    stylizer.step(pose, &mut output)
                } else {
                    stylizer.step_observed(pose, &mut output, &mut looks)
                };
            }
        });
        assert_eq!(looks.0 > 0, method == Method::Mar);
        assert_eq!(taken, 0, "allocations of {method:?}");
    }
}
