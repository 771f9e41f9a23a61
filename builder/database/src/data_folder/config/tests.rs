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
    let message = config.annotate("OLD-1.bvh".as_ref()).unwrap_err().to_string();
    assert!(message.starts_with("OLD-1.bvh: its name doesn't say action and style"), "{message}");
}

#[test]
fn tables_come_before_patterns_and_patterns_before_what_is_built_in() {
    let text = r#"
            patterns = ["{style}-{*}.bvh/no{action}", "{action}_{style}_{*}_{take}.bvh", "{action}_{style}.bvh"]
            files."OLD-1.bvh" = { action = "walk", style = "old", take = "1" }
            names.w = "walk"
            kind.turn-around = "whole"
            unit = "cmu"
            styles = ["old"]
        "#;
    let config = Config::parse(text, "gestus.toml").unwrap();
    assert_eq!(of(&config, "a/OLD-1.bvh"), is("walk", "old", "1", Kind::Gait));
    assert_eq!(of(&config, "w_proud_x_y_3.bvh"), is("walk", "proud", "3", Kind::Gait));
    assert_eq!(of(&config, "turn-around_old.bvh"), is("turn-around", "old", "", Kind::Whole));
    assert_eq!(config.unit(), Some(Unit::Cmu));
    assert!(config.wants(&config.annotate("kick_old.bvh".as_ref()).unwrap()));
    assert!(!config.wants(&config.annotate("kick_sad.bvh".as_ref()).unwrap()));
    let back = Config::parse(&toml::to_string(&config).unwrap(), "again").unwrap();
    assert_eq!(back, config);
}

#[test]
fn errors_say_what_was_expected() {
    let cases = [
        ("ratee = 3", "unknown field `ratee`"),
        ("rate_hz = 0", "`rate_hz` is 0; expected frames a second"),
        ("build.window = 0", "1 to 8 frames"),
        ("build.block_rows = 5", "a power of two"),
        ("build.features = 33", "1 to 32 components"),
        ("unit = 'foot'", "`unit` is foot; expected m, cm"),
        ("rig_unit = 'foot'", "`rig_unit` is foot; expected m, cm"),
        ("patterns = ['{action}']", "both {action} and {style}"),
        ("patterns = ['{action}{style}']", "touch"),
        ("patterns = ['{action}_{style}_{x}']", "expected {action}, {style}, {take} or {*}"),
        ("patterns = ['{action}_{style']", "without a closing one"),
        ("patterns = ['{action}_style}']", "without an opening one"),
        ("patterns = ['{action}_{action}_{style}']", "twice"),
        ("build.pairing = 'best'", "unknown variant `best`"),
        ("files.a = { action = '', style = 'x' }", "without action or style for a"),
    ];
    for (text, words) in cases {
        let message = Config::parse(text, "my.toml").expect_err(text).to_string();
        assert!(message.starts_with("my.toml: ") && message.contains(words), "{text}: {message}");
    }
}

#[test]
fn names_that_no_file_has_are_refused() {
    let files = ["walk_old_1.bvh", "sub/walk_proud_1.bvh", "x_proud_1.bvh"].map(Path::new);
    let check = |text: &str| Config::parse(text, "c").unwrap().check_names(&files).map_err(|e| e.to_string());
    for fine in [
        "",
        "actions = ['walk', 'run']\nnames.x = 'run'\nkind.run = 'whole'",
        "styles = ['old']",
        "files.'sub/walk_proud_1.bvh' = { action = 'hop', style = 'sad' }\nactions = ['hop']",
        "files.'x_proud_1.bvh' = { action = 'hop', style = 'sad' }\nkind.hop = 'whole'",
    ] {
        assert_eq!(check(fine), Ok(()), "{fine}");
    }
    for (text, words) in [
        ("actions = ['walk', 'pnuch']", "`actions`: no action is called `pnuch`: there are walk, x"),
        ("styles = ['odl']", "`styles`: no style is called `odl`: there are old, proud"),
        ("kind.wlak = 'gait'", "`kind`: no action is called `wlak`"),
        ("names.y = 'run'", "`names`: no action, as the files have it, is called `y`"),
        (
            "files.'walk_old_2.bvh' = { action = 'walk', style = 'old' }",
            "`files`: no file is called `walk_old_2.bvh`",
        ),
    ] {
        let message = check(text).unwrap_err();
        assert!(message.starts_with(words), "{message}");
    }
    // Files that say nothing have reasons of their own.
    assert_eq!(Config::parse("styles = ['odl']", "c").unwrap().check_names(&[Path::new("1.bvh")]), Ok(()));
}

#[test]
fn names_that_no_option_could_say_are_refused_with_their_file() {
    let text = "files.'c.bvh' = { action = 'walk', style = 'x/y' }\nnames.w = 'wal,k'";
    let config = Config::parse(text, "c").unwrap();
    for (path, said) in [
        ("in/walk_a,b=c_0.bvh", "in/walk_a,b=c_0.bvh: its style is called `a,b=c`, and `,` splits"),
        ("wa=lk_a_0.bvh", "wa=lk_a_0.bvh: its action is called `wa=lk`, and `=` splits"),
        ("c.bvh", "c.bvh: its style is called `x/y`, and `/` splits"),
        ("w_a_0.bvh", "its action is called `wal,k`"),
    ] {
        let message = config.annotate(path.as_ref()).unwrap_err().to_string();
        assert!(message.contains(said), "{message}");
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
    let file = folder.join("mine.toml");
    for (text, data) in [("", folder.clone()), ("data = 'clips'", folder.join("clips"))] {
        std::fs::write(&file, text).unwrap();
        assert_eq!(Config::read(&file).unwrap().data, Some(data), "{text}");
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
