//! The commands that both revisions run. Each runs in a folder of its own; `..` is the folder of all cases.

use std::path::Path;

use crate::shell::root;

/// A command whose output is compared.
pub struct Case {
    /// Its name, which is its folder's too.
    pub name: &'static str,
    /// `gestus` or `gestus-sim`.
    pub program: &'static str,
    /// The command as it is run.
    pub arguments: Vec<String>,
}

impl Case {
    /// The command as one line.
    pub fn line(&self) -> String {
        format!("{} {}", self.program, self.arguments.join(" "))
    }
}

/// Stands for the folder of real clips.
const DATA: &str = "DATA";
/// Stands for the clips and classes of a measure on real clips, which a quick run has fewer of.
const CLASSES: &str = "CLASSES";
const QUICK_CLASSES: &str = "--actions walk,run --styles normal,active,elderly \
    --from normal --to active,elderly --folds 1";
const FULL_CLASSES: &str = "--actions walk,run,walk-turn-left,walk-turn-right \
    --styles normal,active,elderly,feminine --from normal --folds 2";
/// Stands for a robot's description.
const ROBOT: &str = "ROBOT";
const ROBOT_FILE: &str = "builder/motion/assets/toy.urdf";

/// A stream of generated motion.
const STREAM: &str = "--db ../build/small.gestus --input ../synth/clips/walk_neutral_001.bvh";
/// A stream of the database with the effort dial.
const DIAL: &str = "--db ../build-effort/small.gestus --input ../synth/clips/walk_neutral_001.bvh";
const PROUD: &str = "--db ../build/small.gestus --input ../synth/clips/walk_neutral_001.bvh --style proud";
/// A measure on generated motion.
const GENERATED: &str = "--data ../synth/clips -o report";
const FOLD: &str = "--data ../synth/clips --folds 1 -o report";
/// A measure on real clips.
const REAL: &str = "--data DATA -o report CLASSES";

/// Runs of the short proof as well as the full one.
const QUICK: bool = true;
const FULL: bool = false;

/// Name, `QUICK` or `FULL`, program, arguments, arguments that several cases share. All get `--json`. Databases come
/// first, since later cases read them.
const CASES: &[(&str, bool, &str, &str, &str)] = &[
    (
        "synth",
        QUICK,
        "gestus",
        "synth -o clips --actions walk,run,punch --styles neutral,proud,old --clips 2",
        "",
    ),
    ("build", QUICK, "gestus", "build --data ../synth/clips -o small.gestus", ""),
    ("build-effort", QUICK, "gestus", "build --data ../synth/clips -o small.gestus --effort", ""),
    ("build-20hz", FULL, "gestus", "build --data ../synth/clips -o small.gestus --rate 20 --limit 1", ""),
    ("build-viterbi", FULL, "gestus", "build --data ../synth/clips -o a.gestus --pairing viterbi", ""),
    ("inspect", QUICK, "gestus", "inspect ../build/small.gestus", ""),
    ("export", QUICK, "gestus", "export ../build/small.gestus -o arrays", ""),
    ("cut", QUICK, "gestus", "cut ../build/small.gestus --models-only -o models.gestus", ""),
    ("mar", QUICK, "gestus", "translate -o out.bvh --trace trace.npz", PROUD),
    ("lti", QUICK, "gestus", "translate -o out.bvh --trace trace.npz --method lti", PROUD),
    ("statistic", QUICK, "gestus", "translate -o out.bvh --trace trace.npz --method statistic", PROUD),
    (
        "effort-clip",
        QUICK,
        "gestus",
        "translate -o out.bvh --effort flow=1,weight=-1 --method effort",
        STREAM,
    ),
    ("effort-dial", QUICK, "gestus", "translate -o out.bvh --trace trace.npz --effort flow=1,time=1", DIAL),
    (
        "labelled",
        QUICK,
        "gestus",
        "translate -o out.bvh --trace trace.npz --action walk --input-style neutral --k 24 --timing sync",
        PROUD,
    ),
    ("paper", QUICK, "gestus", "translate -o out.bvh --trace trace.npz --preset paper --no-contact", PROUD),
    (
        "groups",
        QUICK,
        "gestus",
        "translate -o out.bvh --trace trace.npz --group-style left-arm=old --strength right-arm=0.5 \
         --mask right-arm --timing bounded --speed-limit 1 --safety rest",
        PROUD,
    ),
    ("clean-up", QUICK, "gestus", "translate -o out.bvh --clean-up", PROUD),
    (
        "robot",
        FULL,
        "gestus",
        "translate -o out.bvh --csv robot.csv --servo servo.csv --trajectory path.json --robot-section robot.gestus \
         --robot ROBOT",
        PROUD,
    ),
    ("run", QUICK, "gestus-sim", "run -o out.bvh", PROUD),
    ("run-boards", QUICK, "gestus-sim", "run --board all", PROUD),
    (
        "run-faults",
        QUICK,
        "gestus-sim",
        "run --faults drop=0.02,repeat=0.02,delay=0.05:3,corrupt=0.02,seed=7 -o out.bvh",
        PROUD,
    ),
    (
        "retarget",
        QUICK,
        "gestus",
        "retarget --db ../build/small.gestus --input ../synth/clips/run_old_000.bvh -o out.bvh --section map.bin",
        "",
    ),
    (
        "transfer",
        QUICK,
        "gestus",
        "transfer --input ../synth/clips/walk_neutral_000.bvh --reference ../synth/clips/walk_proud_001.bvh \
         -o out.bvh",
        "",
    ),
    (
        "loop",
        QUICK,
        "gestus",
        "loop --style proud=1,old=-0.5 --speed 1.5 -o out.bvh --data ../synth/clips",
        "",
    ),
    (
        "effort-sheet",
        QUICK,
        "gestus",
        "effort sheet --data ../synth/clips -o sheet --fragments 12 --blends 6",
        "",
    ),
    ("real-knn", QUICK, "gestus", "evaluate knn", REAL),
    ("real-exact", QUICK, "gestus", "evaluate exact", REAL),
    ("real-skate", QUICK, "gestus", "evaluate skate", REAL),
    ("real-loo", QUICK, "gestus", "evaluate loo", REAL),
    ("real-methods", QUICK, "gestus", "evaluate methods", REAL),
    ("correspondence", FULL, "gestus", "evaluate correspondence", GENERATED),
    ("bilinear", FULL, "gestus", "evaluate bilinear", GENERATED),
    ("compression", FULL, "gestus", "evaluate compression", GENERATED),
    ("contacts", FULL, "gestus", "evaluate contacts", FOLD),
    ("timing", FULL, "gestus", "evaluate timing", FOLD),
    ("gaussian-process", FULL, "gestus", "evaluate gaussian-process", FOLD),
    ("loo", FULL, "gestus", "evaluate loo --gaussian-process", FOLD),
    ("ablation", FULL, "gestus", "evaluate ablation --actions walk", FOLD),
    ("effort", FULL, "gestus", "evaluate effort --actions walk --splits 5", FOLD),
    ("measure-retarget", FULL, "gestus", "evaluate retarget --db ../build/small.gestus", GENERATED),
    ("servo", FULL, "gestus", "evaluate servo --db ../build/small.gestus", GENERATED),
    ("demo", FULL, "gestus", "demo --out demo", ""),
];

/// The cases of a quick or a full run; those on real clips only where there are some.
pub fn all(quick: bool, data: Option<&Path>) -> Vec<Case> {
    let robot = root().join(ROBOT_FILE).display().to_string();
    let data = data.map(|folder| folder.display().to_string());
    let classes = if quick { QUICK_CLASSES } else { FULL_CLASSES };
    let expand = |word: &str| match word {
        DATA => data.clone().into_iter().collect(),
        CLASSES => classes.split_whitespace().map(str::to_owned).collect(),
        ROBOT => vec![robot.clone()],
        word => vec![word.to_owned()],
    };
    let wanted = CASES.iter().filter(|case| (case.1 || !quick) && (data.is_some() || case.4 != REAL));
    wanted
        .map(|&(name, _, program, arguments, shared)| {
            let words = arguments.split_whitespace().chain(shared.split_whitespace()).chain(["--json"]);
            Case { name, program, arguments: words.flat_map(expand).collect() }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quick_run_is_part_of_a_full_one() {
        let names =
            |quick| all(quick, Some(Path::new("/clips"))).into_iter().map(|c| c.name).collect::<Vec<_>>();
        let (quick, full) = (names(true), names(false));
        assert!(quick.iter().all(|name| full.contains(name)) && quick.len() < full.len());
        let mut unique = full.clone();
        unique.sort_unstable();
        unique.dedup();
        assert_eq!(unique.len(), full.len(), "every case needs a folder of its own");
    }

    #[test]
    fn cases_on_real_clips_need_them() {
        assert!(all(true, None).iter().all(|c| !c.name.starts_with("real-")));
        let cases = all(true, Some(Path::new("/clips")));
        let knn = cases.iter().find(|c| c.name == "real-knn").unwrap();
        assert!(knn.line().starts_with("gestus evaluate knn --data /clips -o report --actions walk,run"));
    }
}
