use std::{fs, sync::Arc};

use super::*;
use crate::{
    build::{BuildOptions, build},
    data_folder::skeletons::size,
    synth::performance,
};
use gestus_motion::{formats::bvh::Bvh, unit::Unit};
use nalgebra::{UnitQuaternion, Vector3};

fn generated() -> Clip {
    performance(1, "walk", "neutral", 30.0, 4.0).unwrap().clip
}

/// The first joint of a long bone.
fn long_bone() -> usize {
    let skeleton = generated().skeleton;
    (1..skeleton.joints())
        .find(|&j| skeleton.offsets[j].norm() > 0.2 && skeleton.parents[j] != Some(0))
        .unwrap()
}

/// The same motion by a body of another size.
fn scale(clip: &mut Clip, times: f64) {
    Arc::make_mut(&mut clip.skeleton).offsets.iter_mut().for_each(|offset| *offset *= times);
    clip.frames.iter_mut().for_each(|frame| frame.root *= times);
}

/// A folder of generated clips, which goes when it is dropped.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("gestus-load-{name}-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    /// Writes a clip of so many frames of a walk.
    fn walk(&self, file: &str, frames: usize, change: impl FnOnce(&mut Clip)) {
        self.write("walk", file, frames, change);
    }

    /// Writes a clip of so many frames of an action.
    fn write(&self, action: &str, file: &str, frames: usize, change: impl FnOnce(&mut Clip)) {
        let mut clip = performance(1, action, "neutral", 30.0, 4.0).unwrap().clip;
        clip.frames.truncate(frames);
        change(&mut clip);
        fs::write(self.0.join(file), Bvh::from_clip(&clip, Unit::Centimetres).unwrap().to_text()).unwrap();
    }

    fn load(&self, more: &str) -> Result<Loaded, LoadError> {
        let mut config = Config::parse(more, "gestus.toml").unwrap();
        config.data = Some(self.0.clone());
        load(&config)
    }
}

/// The clips or files that were left out, and why.
fn reasons(loaded: &Loaded) -> Vec<(&str, Reason)> {
    loaded.left_out.iter().map(|left_out| (left_out.clip.as_str(), left_out.reason)).collect()
}

/// Whether a setting names something that is not there.
fn is_absent(error: &LoadError, of: &str, missing: &str) -> bool {
    matches!(error, LoadError::Names(_, AnnotateError::Absent { key, name, .. }) if *key == of && name == missing)
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn a_clip_of_one_frame_at_another_rate_decides_nothing() {
    let folder = Folder::new("rate");
    folder.walk("walk_a_1.bvh", 1, |clip| clip.rate_hz = 120.0);
    folder.walk("walk_b_1.bvh", 120, |_| ());
    let loaded = folder.load("").unwrap();
    assert_eq!((loaded.corpus.rate_hz, loaded.left_out.len()), (30.0, 1), "{:?}", loaded.notes);
    let slower = folder.load("rate_hz = 20").unwrap();
    assert_eq!((slower.corpus.rate_hz, slower.corpus.examples[0].clip.rate_hz), (20.0, 20.0));
}

/// A recording whose rotations were lost has the kind of its name, and was learned without a word.
#[test]
fn clips_in_which_no_joint_turns_are_told() {
    let folder = Folder::new("stiff");
    for take in 1..=4 {
        folder.write("punch", &format!("punch_a_{take}.bvh"), 120, |clip| {
            for frame in &mut clip.frames {
                frame.rotations[1..].fill(UnitQuaternion::identity());
            }
        });
    }
    folder.write("punch", "punch_b_1.bvh", 120, |_| ());
    let loaded = folder.load("").unwrap();
    let said = "punch_a_1, punch_a_2, punch_a_3, 1 more clips: no joint but the root turns";
    assert!(loaded.notes.iter().any(|note| note.starts_with(said)), "{:?}", loaded.notes);
    assert_eq!((loaded.corpus.examples.len(), loaded.left_out.len()), (5, 0));
}

/// The two lowest fingers of a hand became the legs of a database.
#[test]
fn a_hand_is_no_body() {
    let folder = Folder::new("hand");
    folder.write("punch", "punch_a_1.bvh", 120, |clip| {
        let mut names = vec!["Wrist".to_owned()];
        let (mut parents, mut offsets) = (vec![None], vec![Vector3::zeros()]);
        for (f, finger) in ["Thumb", "Index", "Middle", "Ring", "Pinky"].iter().enumerate() {
            for bone in 0..4 {
                parents.push(Some(if bone == 0 { 0 } else { names.len() - 1 }));
                names.push(format!("{finger}{bone}"));
                offsets.push(Vector3::new(0.02 * (f as f64 - 2.0), -0.4, 0.0));
            }
        }
        clip.skeleton = Arc::new(Skeleton { names, parents, offsets });
        clip.frames.iter_mut().for_each(|frame| frame.rotations.resize(21, UnitQuaternion::identity()));
    });
    let error = folder.load("unit = 'cm'").unwrap_err();
    assert!(matches!(error, LoadError::Landmark(..)), "{error}");
}

#[test]
fn clips_of_one_name_are_told_apart_by_their_folders() {
    let folder = Folder::new("names");
    for style in ["a", "b"] {
        fs::create_dir_all(folder.0.join(style)).unwrap();
        folder.walk(&format!("{style}/walk-1.bvh"), 120, |_| ());
    }
    folder.walk("a/walk-2.bvh", 120, |_| ());
    let loaded = folder.load("patterns = [\"{style}/{action}-{take}.bvh\"]").unwrap();
    let mut names: Vec<&str> = loaded.corpus.examples.iter().map(|e| e.clip.name.as_str()).collect();
    names.sort_unstable();
    assert_eq!(names, ["a/walk-1", "b/walk-1", "walk-2"]);
}

#[test]
fn the_skeleton_is_the_one_that_most_files_have() {
    let folder = Folder::new("skeleton");
    folder.walk("walk_a_1.bvh", 120, |clip| Arc::make_mut(&mut clip.skeleton).names[3] = "Other".into());
    folder.walk("walk_b_1.bvh", 120, |_| ());
    folder.walk("walk_c_1.bvh", 120, |_| ());
    let loaded = folder.load("").unwrap();
    assert_eq!(loaded.corpus.styles, ["b", "c"]);
    assert_eq!(reasons(&loaded), [("walk_a_1", Reason::Skeleton)]);
}

/// Of a skeleton of the same joints rotations may mean something else, or lengths.
#[test]
fn a_body_in_another_rest_pose_or_unit_is_left_out_and_named() {
    let folder = Folder::new("rest");
    folder.walk("walk_a_1.bvh", 120, |_| ());
    folder.walk("walk_b_1.bvh", 120, |_| ());
    let arm = long_bone();
    folder.walk("walk_c_1.bvh", 120, |clip| {
        let offset = &mut Arc::make_mut(&mut clip.skeleton).offsets[arm];
        *offset = nalgebra::Rotation3::from_euler_angles(0.0, 0.0, 1.0) * *offset;
    });
    folder.walk("walk_d_1.bvh", 120, |clip| scale(clip, 0.01));
    let loaded = folder.load("unit = 'cm'").unwrap();
    assert_eq!(loaded.corpus.styles, ["a", "b"]);
    assert_eq!(reasons(&loaded), [("walk_c_1", Reason::Skeleton), ("walk_d_1", Reason::Skeleton)]);
}

/// A folder with Z up became a database of bodies that lie.
#[test]
fn clips_of_another_world_are_turned_to_y_up() {
    let turn = |name: &str, axis: nalgebra::Unit<nalgebra::Vector3<f64>>, angle: f64| {
        let folder = Folder::new(name);
        for style in ["a", "b"] {
            for take in 1..=2 {
                folder.write("walk", &format!("walk_{style}_{take}.bvh"), 120, |clip| {
                    let turn = nalgebra::UnitQuaternion::from_axis_angle(&axis, angle);
                    for frame in &mut clip.frames {
                        frame.root = turn * frame.root;
                        frame.rotations[0] = turn * frame.rotations[0];
                    }
                });
            }
        }
        folder.load("").unwrap()
    };
    let x = nalgebra::Vector3::x_axis();
    let quarter = std::f64::consts::FRAC_PI_2;
    let plain = turn("y-up", x, 0.0);
    assert!(!plain.notes.join("\n").contains("turned"), "{:?}", plain.notes);
    for (name, angle, said) in
        [("z-up", quarter, "4 clips have z up"), ("z-down", -quarter, "4 clips have -z up")]
    {
        let turned = turn(name, x, angle);
        assert!(turned.notes.join("\n").contains(said), "{:?}", turned.notes);
        assert_eq!(turned.corpus.examples.len(), plain.corpus.examples.len());
        let both = turned.corpus.examples.iter().zip(&plain.corpus.examples);
        for (a, b) in both.flat_map(|(a, b)| a.clip.frames.iter().zip(&b.clip.frames)) {
            assert!((a.root - b.root).norm() < 1e-4, "{name}");
            assert!(a.rotations[0].angle_to(&b.rotations[0]) < 1e-4, "{name}");
        }
    }
}

/// A wrong unit or floor made a database of giants, or one that did not open.
#[test]
fn bodies_of_a_wrong_size_or_far_from_their_floor_are_left_out() {
    let folder = Folder::new("giants");
    for style in ["a", "b"] {
        folder.walk(&format!("walk_{style}_1.bvh"), 120, |_| ());
    }
    for (wrong, said) in [
        ("unit = \"m\"", "legs are "),
        ("unit = \"1e-5\"", "legs are 0.00 m"),
        ("floor = 15.0", "above the floor at 15 m"),
        ("floor = -90.0", "above the floor at -90 m"),
    ] {
        let error = folder.load(wrong).unwrap_err();
        assert!(
            matches!(&error, LoadError::Empty { detail, .. } if detail.contains(said)),
            "{wrong}: {error}"
        );
    }
    // A toy, a body on a stage, and one of two clips.
    for right in ["unit = \"mm\"", "floor = -3.0", "floor = 0.5"] {
        assert_eq!(folder.load(right).unwrap().left_out, [], "{right}");
    }
    let loaded = folder.load("[floors]\n\"walk_a_1.bvh\" = 15.0").unwrap();
    assert_eq!(reasons(&loaded), [("walk_a_1", Reason::Size)]);
}

/// A folder in which some clips had their floor at the hips taught feet at two heights.
#[test]
fn clips_on_floors_of_their_own_are_moved_onto_one_at_zero() {
    let actions = ["walk", "run", "jump"];
    let write = |name: &str, floors: [f64; 3]| {
        let folder = Folder::new(name);
        for (action, floor) in actions.iter().zip(floors) {
            for style in ["a", "b"] {
                folder.write(action, &format!("{action}_{style}_1.bvh"), 120, |clip| {
                    clip.frames.iter_mut().for_each(|frame| frame.root.y += floor);
                });
            }
        }
        folder
    };
    // How far the hips of the first clip of each action are above those of another folder's, metres.
    let above = |one: &Loaded, other: &Loaded| {
        let first = |loaded: &Loaded, action: usize| {
            let of = loaded.corpus.examples.iter().find(|e| e.action == action).unwrap();
            of.clip.frames[7].root.y
        };
        [0, 1, 2].map(|action| first(one, action) - first(other, action))
    };
    let plain = write("plain-floor", [0.0; 3]).load("").unwrap();
    assert_eq!(plain.floors, []);
    for floors in [[0.0, -0.72, 1.3], [0.0, 0.4, 0.41]] {
        let folder = write("own-floors", floors);
        let moved = folder.load("").unwrap();
        let apart = above(&moved, &plain);
        assert!(apart.iter().all(|apart| apart.abs() < 0.02), "{floors:?}: {apart:?}");
        assert_eq!(moved.floors.len(), 4, "{:?}", moved.floors);
        let said = moved.notes.join("\n");
        assert!(said.contains("_a_1 is on a floor at ") && said.contains("`[floors]`"), "{said}");
        // What is told is not looked for.
        let told = folder.load("floor = 0.0\n[floors]\n\"walk_a_1.bvh\" = 0.5").unwrap();
        let [jump, run, walk] = above(&told, &plain);
        let off = [walk + 0.5, run - floors[1], jump - floors[2]];
        assert!(off.iter().all(|off| off.abs() < 1e-5), "{off:?}");
    }
    // All on one floor: as tall as before, up to the height of a sole.
    let sunk = write("sunk", [-0.72; 3]).load("").unwrap();
    let [a, b, c] = above(&sunk, &plain);
    assert!(sunk.floors.len() == 6 && (a - b).abs() < 1e-5 && (a - c).abs() < 1e-5, "{:?}", sunk.floors);
    assert!(a.abs() < 0.04, "{a}");
    let error = Config::parse("[floors]\nx = 30000000", "c").unwrap_err();
    assert!(
        matches!(&error, AnnotateError::Value { key, found, .. } if key == "floors.\"x\"" && found == "30000000"),
        "{error}"
    );
    let error = write("sunk", [0.0; 3]).load("[floors]\nx = 3").unwrap_err();
    assert!(is_absent(&error, "floors", "x"), "{error}");
}

/// A tall actor's steps are a tall body's, and his feet are where its feet are.
#[test]
fn a_larger_body_takes_the_steps_of_the_common_one() {
    let folder = Folder::new("tall");
    folder.walk("walk_a_1.bvh", 120, |_| ());
    folder.walk("walk_b_1.bvh", 120, |clip| scale(clip, 1.2));
    let corpus = folder.load("").unwrap().corpus;
    let [one, other] = &corpus.examples[..] else { panic!("both are used") };
    assert_eq!(one.clip.skeleton, other.clip.skeleton);
    let apart = one.clip.frames.iter().zip(&other.clip.frames).map(|(a, b)| (a.root - b.root).norm());
    let most = apart.fold(0.0, f64::max);
    // Both are the same performance; files hold some digits.
    assert!(most < 1e-4, "{most}");
    let middle = (size(&one.clip.skeleton) / size(&generated().skeleton) - 1.1).abs();
    assert!(middle < 1e-4, "{middle}");
}

#[test]
fn a_limit_counts_what_is_used() {
    let folder = Folder::new("limit");
    folder.walk("walk_a_1.bvh", 5, |_| ());
    folder.walk("walk_a_2.bvh", 120, |_| ());
    folder.walk("walk_a_3.bvh", 120, |_| ());
    let loaded = folder.load("limit = 1").unwrap();
    assert_eq!((loaded.corpus.examples.len(), loaded.left_out.len()), (1, 1), "{:?}", loaded.notes);
    assert_eq!(loaded.corpus.examples[0].clip.name, "walk_a_2");
}

/// What registration leaves out had its say in the length of everybody's bones, but for a limit.
#[test]
fn a_clip_that_is_left_out_has_no_say_in_the_bones() {
    let folder = Folder::new("bones");
    folder.walk("walk_a_1.bvh", 120, |_| ());
    folder.walk("walk_b_1.bvh", 120, |_| ());
    let alone = folder.load("").unwrap().corpus.skeleton;
    let tall = |clip: &mut Clip| {
        Arc::make_mut(&mut clip.skeleton).offsets.iter_mut().for_each(|offset| *offset *= 1.3);
    };
    folder.walk("walk_a_2.bvh", 5, tall);
    let loaded = folder.load("").unwrap();
    assert_eq!((loaded.corpus.examples.len(), loaded.left_out.len()), (2, 1), "{:?}", loaded.notes);
    assert_eq!(loaded.corpus.skeleton.offsets, alone.offsets);
    // Nothing is left out, of whatever reason, and all of it is told.
    fs::write(folder.0.join("walk_b_2.bvh"), "HIERARCHY").unwrap();
    assert_eq!(
        reasons(&folder.load("").unwrap()),
        [("walk_b_2.bvh", Reason::Unreadable), ("walk_a_2", Reason::Brief)]
    );
    let error = folder.load("strict = true").unwrap_err();
    assert!(matches!(error, LoadError::Strict(..)), "{error}");
    let said = error.to_string();
    assert!(said.contains("walk_a_2") && said.contains("walk_b_2.bvh:1:"), "{said}");
}

/// A calibration pose, beside good clips: `build` called its knots a fault of the builder.
#[test]
fn a_pose_among_the_clips_of_an_action_is_left_out_and_named() {
    let folder = Folder::new("pose");
    for style in ["a", "b"] {
        folder.write("punch", &format!("punch_{style}_2.bvh"), 60, |_| ());
    }
    for frames in [1, 2] {
        folder.write("punch", "punch_a_1.bvh", frames, |_| ());
        for limit in ["", "limit = 1"] {
            let loaded = folder.load(limit).unwrap();
            assert_eq!(reasons(&loaded), [("punch_a_1", Reason::Short)]);
            assert_eq!(loaded.corpus.examples.len(), 2);
            build(&loaded.corpus, &BuildOptions::default()).unwrap();
        }
    }
    // As its style's only clip it leaves the style out, and with it what nothing else can be paired with.
    folder.write("punch", "punch_c_1.bvh", 1, |_| ());
    assert_eq!(folder.load("").unwrap().corpus.styles, ["a", "b"]);
}

/// A dance that is called a walk: it was left out in every style.
#[test]
fn an_action_without_cycles_is_taken_as_a_whole() {
    let folder = Folder::new("whole");
    for style in ["a", "b"] {
        folder.walk(&format!("walk_{style}_1.bvh"), 120, |_| ());
        folder.walk(&format!("run_{style}_1.bvh"), 12, |_| ());
    }
    let loaded = folder.load("").unwrap();
    assert_eq!((loaded.corpus.actions.len(), loaded.left_out.len()), (2, 0), "{:?}", loaded.notes);
    assert!(loaded.notes.iter().any(|n| n.contains("action run: no clip has a gait cycle")));
    // Where the folder says what it is, it is that.
    let loaded = folder.load("kind = { run = 'gait' }").unwrap();
    assert_eq!((loaded.corpus.actions.len(), loaded.left_out.len()), (1, 2), "{:?}", loaded.notes);
}

/// An action called `stroll` was taken as a whole, from the start of a clip to its end, and its walk was lost.
#[test]
fn an_action_whose_clips_walk_is_a_gait_whatever_its_name() {
    let folder = Folder::new("stroll");
    for style in ["a", "b"] {
        folder.write("walk", &format!("stroll_{style}_1.bvh"), 120, |_| ());
        folder.write("punch", &format!("jab_{style}_1.bvh"), 60, |_| ());
    }
    let kinds = |more: &str| {
        let loaded = folder.load(more).unwrap();
        let kind = |name: &str| {
            let example = loaded.corpus.examples.iter().find(|e| e.clip.name == name).unwrap();
            Kind::of_cycle(&example.cycles[0])
        };
        let told = loaded.notes.iter().any(|n| n.contains("action stroll: its clips walk"));
        ([kind("stroll_a_1"), kind("jab_b_1")], told)
    };
    assert_eq!(kinds(""), ([Kind::Gait, Kind::Whole], true));
    assert_eq!(kinds("kind = { stroll = 'whole' }"), ([Kind::Whole; 2], false));
}

/// The advice was to take all clips of the action as a whole, which spoils the good ones.
#[test]
fn a_gait_too_short_for_a_cycle_has_to_be_longer() {
    let folder = Folder::new("brief");
    folder.walk("walk_a_1.bvh", 120, |_| ());
    folder.walk("walk_a_2.bvh", 20, |_| ());
    let loaded = folder.load("").unwrap();
    assert_eq!(reasons(&loaded), [("walk_a_2", Reason::Brief)]);
    assert_eq!(Group::all(&loaded.left_out)[0].change, "");
}

/// Takes that are joined in one file: their database jumped from one to the other.
#[test]
fn clips_are_cut_where_the_body_leaps() {
    let folder = Folder::new("leaps");
    folder.walk("walk_a_1.bvh", 120, |clip| clip.frames.extend(clip.frames.clone()));
    folder.walk("walk_b_1.bvh", 120, |_| ());
    let apart = |frame: usize| move |clip: &mut Clip| clip.frames[frame].root += Vector3::new(3.0, 0.0, 0.0);
    // A calibration pose elsewhere; and a wrong place in the middle.
    folder.write("punch", "punch_a_1.bvh", 60, apart(0));
    folder.write("punch", "punch_b_1.bvh", 60, |_| ());
    folder.write("punch", "punch_b_2.bvh", 60, apart(30));
    let loaded = folder.load("").unwrap();
    let mut clips: Vec<(&str, usize)> =
        loaded.corpus.examples.iter().map(|e| (e.clip.name.as_str(), e.clip.frames.len())).collect();
    clips.sort_unstable();
    assert_eq!(
        clips,
        [("punch_a_1@1", 48), ("punch_b_1", 49), ("walk_a_1", 120), ("walk_a_1@120", 120), ("walk_b_1", 120)]
    );
    assert_eq!(reasons(&loaded), [("punch_b_2", Reason::Leap)]);
    assert!(loaded.notes.iter().any(|n| n.starts_with("walk_a_1: ") && n.contains("at frame 120 ")));
}

/// Clips of games and of Mixamo: their database walked on the spot, and everything that gets along was unlike it.
#[test]
fn bodies_that_walk_in_place_are_moved_over_the_ground() {
    let folder = Folder::new("in-place");
    let hold = |clip: &mut Clip| {
        clip.frames.iter_mut().for_each(|frame| (frame.root.x, frame.root.z) = (0.0, 0.0));
    };
    folder.walk("walk_a_1.bvh", 120, hold);
    folder.walk("walk_b_1.bvh", 120, |_| ());
    folder.write("punch", "punch_a_1.bvh", 60, |_| ());
    let loaded = folder.load("").unwrap();
    let way = |name: &str| {
        let frames = &loaded.corpus.examples.iter().find(|e| e.clip.name == name).unwrap().clip.frames;
        (frames[110].root - frames[10].root).norm()
    };
    let (held, moved) = (way("walk_a_1"), way("walk_b_1"));
    assert!((held / moved - 1.0).abs() < 0.1, "{held} {moved} m");
    let told: Vec<&String> = loaded.notes.iter().filter(|n| n.contains("walking in place")).collect();
    assert!(
        matches!(&told[..], [one] if one.starts_with("walk_a_1 at ") && !one.contains("_b_")),
        "{told:?}"
    );
}

#[test]
fn names_that_differ_by_capital_letters_are_told() {
    let folder = Folder::new("capitals");
    for name in ["walk_a_1", "walk_A_2", "walk_b_1"] {
        folder.walk(&format!("{name}.bvh"), 120, |_| ());
    }
    let notes = folder.load("").unwrap().notes;
    assert_eq!(notes.iter().filter(|n| n.contains("capital letters")).count(), 1, "{notes:?}");
}

#[test]
fn terms_in_the_folder_are_named() {
    let folder = Folder::new("terms");
    folder.walk("walk_a_1.bvh", 120, |_| ());
    fs::write(folder.0.join("LICENSE.txt"), "mine").unwrap();
    let has = |more: &str| folder.load(more).unwrap().notes.iter().any(|n| n.contains("LICENSE.txt"));
    assert!(has("") && !has("licence = 'CC-BY'"));
}

#[test]
fn what_is_not_there_is_named() {
    let folder = Folder::new("not-there");
    folder.walk("walk_a_1.bvh", 120, |_| ());
    assert!(is_absent(&folder.load("styles = ['proud']").unwrap_err(), "styles", "proud"));
    assert!(is_absent(&folder.load("actions = ['walk', 'pnuch']").unwrap_err(), "actions", "pnuch"));
    let config = Config { data: Some(folder.0.join("walk_a_1.bvh")), ..Config::default() };
    let error = load(&config).unwrap_err();
    assert!(matches!(&error, LoadError::File(file) if file.ends_with("walk_a_1.bvh")), "{error}");
}

#[test]
fn a_clip_that_would_fill_the_memory_is_left_out() {
    let folder = Folder::new("memory");
    folder.walk("walk_a_1.bvh", 120, |_| ());
    folder.walk("walk_b_1.bvh", 120, |clip| {
        clip.rate_hz = 1.0;
        clip.frames = clip.frames.iter().cycle().take(400).cloned().collect();
    });
    let loaded = folder.load("rate_hz = 1000").unwrap();
    assert_eq!(reasons(&loaded), [("walk_b_1.bvh", Reason::Unreadable)]);
    assert_eq!(loaded.corpus.styles, ["a"]);
}
