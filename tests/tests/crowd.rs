//! A crowd moves to the bits of its characters alone: in one call, and on threads.

use gestus_core::{Config, Database, Method, Pose, Report, Stylizer, step_many};
use gestus_database::stream::{crowd, to_pose};
use gestus_tests::motion;

const COUNT: usize = 13;
type Gestus<'db> = Stylizer<'db, 21, 16, 6>;

fn characters(database: Database<'_>) -> Vec<Gestus<'_>> {
    let character = |i: usize| {
        let config = Config::new().method(Method::ALL[i % Method::ALL.len()]);
        let mut stylizer = Gestus::new(database, config).unwrap();
        stylizer.set_style(&[((i % 3) as u16, 1.0)]).unwrap();
        stylizer
    };
    (0..COUNT).map(character).collect()
}

#[test]
fn one_call_and_threads_give_the_bits_of_single_steps() {
    let database = Database::open(motion::small()).unwrap();
    let poses: Vec<Pose<21>> = motion::unseen(0, 0, 24 + COUNT).frames.iter().map(to_pose).collect();
    let [mut alone, mut together, mut threads] = [(); 3].map(|()| characters(database));
    let mut outputs = [(); 3].map(|()| vec![Pose::<21>::IDENTITY; COUNT]);
    let mut reports = [(); 3].map(|()| vec![Report::default(); COUNT]);
    for t in 0..24 {
        let inputs = &poses[t..t + COUNT];
        for (i, stylizer) in alone.iter_mut().enumerate() {
            reports[0][i] = stylizer.step(&inputs[i], &mut outputs[0][i]);
        }
        assert_eq!(step_many(&mut together, inputs, &mut outputs[1], &mut reports[1]), COUNT);
        crowd::step_many(&mut threads, inputs, &mut outputs[2], &mut reports[2]);
        assert_eq!(outputs[0], outputs[1], "frame {t}");
        assert_eq!(outputs[0], outputs[2], "frame {t}");
        assert_eq!(reports[0], reports[1], "frame {t}");
        assert_eq!(reports[0], reports[2], "frame {t}");
    }
    // The shortest slice counts.
    assert_eq!(step_many(&mut together, &poses[..5], &mut outputs[1], &mut reports[1]), 5);
}
