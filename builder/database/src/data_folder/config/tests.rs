use super::*;

fn of(config: &Config, path: &str) -> (String, String, String, Kind) {
    let Annotation { action, style, take, kind } = config.annotate(path.as_ref()).unwrap();
    (action, style, take, kind)
}

fn is(action: &str, style: &str, take: &str, kind: Kind) -> (String, String, String, Kind) {
    (action.into(), style.into(), take.into(), kind)
}

#[test]
fn known_names_need_no_file() {
    let config = Config::default();
    let cases = [
        ("dataset-2_walk-turn-left_active_001.bvh", is("walk-turn-left", "active", "001", Kind::Gait)),
        ("x/dataset-1_bow_not-confident_001.BVH", is("bow", "not-confident", "001", Kind::Whole)),
        ("angry_13_000.bvh", is("run", "angry", "000", Kind::Gait)),
        ("neutral_01_000.bvh", is("walk", "neutral", "000", Kind::Gait)),
        ("neutral_01_000.GLB", is("walk", "neutral", "000", Kind::Gait)),
        ("neutral_07_000.bvh", is("07", "neutral", "000", Kind::Whole)),
        ("raise_arm_proud_2.bvh", is("raise_arm", "proud", "2", Kind::Whole)),
    ];
    for (path, expected) in cases {
        assert_eq!(of(&config, path), expected, "{path}");
    }
    let unknown = AnnotateError::Unknown { file: "OLD-1.bvh".into() };
    assert_eq!(config.annotate("OLD-1.bvh".as_ref()), Err(unknown));
}

#[test]
fn tables_come_before_patterns_and_patterns_before_what_is_built_in() {
    let text = r#"
            patterns = ["{style}-{*}.bvh/no{action}", "{action}_{style}_{*}_{take}.bvh", "{action}_{style}.bvh"]
            files."OLD-1.bvh" = { action = "walk", style = "old", take = "1" }
            names.w = "walk"
            kind.turn-around = "whole"
            unit = "cmu"
            up = "-z"
            styles = ["old"]
        "#;
    let config = Config::parse(text, "gestus.toml").unwrap();
    assert_eq!(of(&config, "a/OLD-1.bvh"), is("walk", "old", "1", Kind::Gait));
    assert_eq!(of(&config, "w_proud_x_y_3.bvh"), is("walk", "proud", "3", Kind::Gait));
    assert_eq!(of(&config, "turn-around_old.bvh"), is("turn-around", "old", "", Kind::Whole));
    assert_eq!((config.unit(), config.up), (Some(Unit::Cmu), Some((2, -1.0))));
    assert!(config.wants(&config.annotate("kick_old.bvh".as_ref()).unwrap()));
    assert!(!config.wants(&config.annotate("kick_sad.bvh".as_ref()).unwrap()));
    let back = Config::parse(&toml::to_string(&config).unwrap(), "again").unwrap();
    assert_eq!(back, config);
}

#[test]
fn what_cannot_be_used_is_named_by_its_key() {
    for (text, key) in [
        ("rate_hz = 0", "rate_hz"),
        ("build.window = 0", "build.window"),
        ("build.block_rows = 5", "build.block_rows"),
        ("build.features = 33", "build.features"),
        ("unit = 'foot'", "unit"),
        ("floor = 1e9", "floor"),
        ("floor = 1\nfloors.'a_b.bvh' = 1e9", "floors.\"a_b.bvh\""),
        ("rig_unit = 'foot'", "rig_unit"),
        ("files.a = { action = '', style = 'x' }", "files"),
    ] {
        let error = Config::parse(text, "my.toml").expect_err(text);
        let AnnotateError::Value { file, key: named, .. } = &error else { panic!("{text}: {error}") };
        assert_eq!((file.as_str(), named.as_str()), ("my.toml", key), "{text}");
    }
    for (pattern, problem) in [
        ("{action}", PatternError::Missing),
        ("{action}{style}", PatternError::Touching),
        ("{action}_{style}_{x}", PatternError::Placeholder),
        ("{action}_{style", PatternError::NoClosing),
        ("{action}_style}", PatternError::NoOpening),
        ("{action}_{action}_{style}", PatternError::Twice),
        ("{action}_{style}_{*}_{*}_{*}_{*}_{*}", PatternError::TooMany),
    ] {
        let error = AnnotateError::Pattern { file: "my.toml".into(), pattern: pattern.into(), problem };
        assert_eq!(Config::parse(&format!("patterns = ['{pattern}']"), "my.toml"), Err(error));
    }
    // What the file's parser refuses has its words alone.
    for (text, words) in [
        ("ratee = 3", "unknown field `ratee`"),
        ("build.pairing = 'best'", "unknown variant `best`"),
        ("unit = 'm'\nup = 'north'", "line 2"),
        ("unit = 'm'\nup = 'north'", "`north` is no axis: x, y, z, -x, -y or -z"),
    ] {
        let error = Config::parse(text, "my.toml").expect_err(text);
        let AnnotateError::Toml { error: said, .. } = &error else { panic!("{text}: {error}") };
        assert!(said.contains(words), "{text}: {said}");
    }
}

#[test]
fn names_that_no_file_has_are_refused() {
    let files = ["walk_old_1.bvh", "sub/walk_proud_1.bvh", "x_proud_1.bvh"].map(Path::new);
    let check = |text: &str| Config::parse(text, "c").unwrap().check_names(&files);
    for fine in [
        "",
        "actions = ['walk', 'run']\nnames.x = 'run'\nkind.run = 'whole'",
        "styles = ['old']",
        "files.'sub/walk_proud_1.bvh' = { action = 'hop', style = 'sad' }\nactions = ['hop']",
        "files.'x_proud_1.bvh' = { action = 'hop', style = 'sad' }\nkind.hop = 'whole'",
    ] {
        assert_eq!(check(fine), Ok(()), "{fine}");
    }
    for (text, key, name) in [
        ("actions = ['walk', 'pnuch']", "actions", "pnuch"),
        ("styles = ['odl']", "styles", "odl"),
        ("kind.wlak = 'gait'", "kind", "wlak"),
        ("names.y = 'run'", "names", "y"),
        ("files.'walk_old_2.bvh' = { action = 'walk', style = 'old' }", "files", "walk_old_2.bvh"),
    ] {
        let error = check(text).unwrap_err();
        let AnnotateError::Absent { key: named, name: absent, have, .. } = &error else { panic!("{error}") };
        assert_eq!((*named, absent.as_str()), (key, name), "{text}");
        assert!(key != "styles" || have == "old, proud", "{have}");
    }
    // Files that say nothing have reasons of their own.
    assert_eq!(Config::parse("styles = ['odl']", "c").unwrap().check_names(&[Path::new("1.bvh")]), Ok(()));
}

#[test]
fn names_that_no_option_could_say_are_refused_with_their_file() {
    let text = "files.'c.bvh' = { action = 'walk', style = 'x/y' }\nnames.w = 'wal,k'";
    let config = Config::parse(text, "c").unwrap();
    for (path, what, name, found) in [
        ("in/walk_a,b=c_0.bvh", "style", "a,b=c", ','),
        ("wa=lk_a_0.bvh", "action", "wa=lk", '='),
        ("c.bvh", "style", "x/y", '/'),
        ("w_a_0.bvh", "action", "wal,k", ','),
    ] {
        let error = AnnotateError::Name { file: path.into(), what, name: name.into(), found };
        assert_eq!(config.annotate(path.as_ref()), Err(error));
    }
    assert!(config.annotate("walk_half+half_0.bvh".as_ref()).is_ok());
}

#[test]
fn a_file_is_of_the_class_that_its_path_below_the_folder_says() {
    let config = Config::parse("patterns = ['{style}/{action}-{take}']", "c").unwrap();
    let class = |folder: &str, path: &str| config.class(folder.as_ref(), path.as_ref());
    let is = |action: &str, style: &str| Some((action.to_owned(), style.to_owned()));
    assert_eq!(class("data", "data/proud/walk-1.bvh"), is("walk", "proud"));
    assert_eq!(class("data/run_sad_1.bvh", "data/run_sad_1.bvh"), is("run", "sad"));
    assert_eq!(class("data", "data/09_04.bvh"), None);
}

#[test]
fn a_configuration_is_about_the_folder_that_it_is_in() {
    let folder = std::env::temp_dir().join(format!("gestus-annotate-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let file = folder.join(FILE_NAME);
    for (text, data) in [("", folder.clone()), ("data = 'clips'", folder.join("clips"))] {
        std::fs::write(&file, text).unwrap();
        assert_eq!(Config::read(&file).unwrap().data, Some(data), "{text}");
        // As the file of a folder of clips, it is about that folder.
        assert_eq!(Config::of_folder(&folder).unwrap().data, Some(folder.clone()), "{text}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn gaits_are_known_by_whole_words() {
    for gait in ["walk", "Walking", "walk-turn-left", "run", "running", "jog", "turn_right", "march", "dash"]
    {
        assert_eq!(Kind::of_action(gait), Kind::Gait, "{gait}");
    }
    for whole in ["return", "trunk", "kick", "wave-both-hands", "jump", "prune"] {
        assert_eq!(Kind::of_action(whole), Kind::Whole, "{whole}");
    }
}

/// The advice for a folder a style was a pattern that does not match it.
#[test]
fn the_pattern_that_is_advised_labels_the_file() {
    for (path, pattern, labels) in [
        ("Elderly/run-1.bvh", "{style}/{action}-{take}.bvh", ["run", "Elderly", "1"]),
        ("walk/proud 02.glb", "{action}/{style} {take}.glb", ["walk", "proud", "02"]),
        ("set/old/kick.bvh", "{*}/{style}/{action}.bvh", ["kick", "old", ""]),
        ("Elderly Walk 01.bvh", "{style} {action} {take}.bvh", ["Walk", "Elderly", "01"]),
        ("3-run.old-7.bvh", "{*}-{action}.{style}-{take}.bvh", ["run", "old", "7"]),
        ("elderly1.bvh", "{action}_{style}_{take}.bvh", ["", "", ""]),
    ] {
        assert_eq!(example(path), pattern, "{path}");
        let config = Config { patterns: vec![example(path)], ..Config::default() };
        match config.annotate(Path::new(path)) {
            Ok(found) => assert_eq!([&found.action[..], &found.style, &found.take], labels, "{path}"),
            Err(error) => assert_eq!(labels, [""; 3], "{error}"),
        }
    }
}
