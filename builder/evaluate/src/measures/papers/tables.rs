//! The tables and figures of the papers: what is measured for each, what the paper says, and what differs.

use anyhow::Result;

use crate::{
    evaluation::Evaluation,
    experiment::Experiment,
    measures::{
        OnClips, ablation, bilinear, comparison, contacts, correspondence, cost, cost::paper_size, cross,
        deviations, effort, field, knn, literal, loo, sheets, skate, timing, transfer, transitions,
    },
};

/// A table or figure of a paper.
pub struct Table {
    /// Paper and place.
    pub name: &'static str,
    /// What the paper reports.
    pub paper: &'static str,
    /// What differs here, in data above all.
    pub differs: &'static str,
    /// Runs the measure that makes its counterpart on the clips.
    pub run: fn(&Experiment) -> Result<Evaluation>,
    /// Columns of the measure's means that name a row, and columns of figures, with spaces between them.
    pub keys: (&'static str, &'static str),
    /// Whether it takes an hour or more, and runs with `--all` alone.
    pub long: bool,
    /// Numbers that the paper prints: method, our key, their number.
    pub numbers: &'static [(&'static str, &'static str, f64)],
}

/// What most tables have in common.
const TABLE: Table = Table {
    name: "",
    paper: "",
    differs: "",
    run: |_| anyhow::bail!("a table without a measure"),
    keys: ("", ""),
    long: false,
    numbers: &[],
};

const ERRORS: &str = "delivered_error_cm delivered_over_floor joint_error_cm step_error_ms duration_error \
                      delivered_variability delivered_third_difference";

/// All of them, paper by paper.
pub const TABLES: &[Table] = &[
    Table {
        name: "Xia 2015, Tables 1 and 2: size, and time by component",
        paper: "79,829 frames; a frame takes 18.1 ms: search 7.31, regression 9.7, post-processing 1.09, with search and \
                regression on a GPU of 2013; 200 MB of the GPU's memory and 90 MB of the computer's",
        differs: "one thread of this machine; `generated` is motion of a generator in a database of the paper's size; the search \
                  is approximate, and `mixture` has K 8 where the paper and `mixture-paper` have 40",
        run: |e| cost::Args { generated: true }.evaluate(e),
        keys: (
            "set method component",
            "us_mean us_median us_p99 share visits_mean classes_mean bytes_read_mean stylizer_bytes \
             frames classes database_bytes bytes_per_frame build_s",
        ),
        numbers: &[
            ("mixture-paper knn-search", "us_mean", 7310.0),
            ("mixture-paper mar", "us_mean", 9700.0),
            ("mixture-paper post-processing", "us_mean", 1090.0),
            ("mixture-paper total", "us_mean", 18100.0),
            ("mixture-paper knn-search", "share", 0.404),
            ("mixture-paper mar", "share", 0.536),
            ("mixture-paper post-processing", "share", 0.06),
            ("database total", "frames", 79829.0),
        ],
        ..TABLE
    },
    Table {
        name: "Xia 2015, Table 1: the search at the paper's size",
        paper: "every neighbor is found, by brute force on a GPU",
        differs: "a graph a class, over generated motion; recall against brute force over the same features",
        run: |_| knn::Args.evaluate(&paper_size::experiment()?),
        keys: ("method", "recall visits_mean us_per_query"),
        ..TABLE
    },
    Table {
        name: "Xia 2015, Figures 3, 4 and 6, section 7.2.1",
        paper: "leave one out on MIT's walks, their walks, and walk, run and jump: their method is nearer to the truth than \
                the linear model of Hsu 2005, in pose and in timing (bars without numbers)",
        differs: "no recorded pairs: the truth is another take of nearest content; one fold a test clip and style; their \
                  linear model is `lti-paper`, ours `lti`",
        run: |e| loo::Args::default().evaluate(e),
        keys: ("method", ERRORS),
        ..TABLE
    },
    Table {
        name: "Xia 2015, section 7.2.2 and Table 3",
        paper: "Gaussian processes: good on one pair of walks, poor on heterogeneous motion; the method is good labelled and \
                unlabelled",
        differs: "numbers instead of good and poor; generated pairs and pairs by rule beside captured clips",
        run: |e| comparison::Args.evaluate(e),
        keys: ("set method", ERRORS),
        long: true,
        ..TABLE
    },
    Table {
        name: "Xia 2015, eq. 1, and neighbors for timing and contacts",
        paper: "each pair of clouds is aligned, with weights that may taper off; timing and contacts have searches of their own \
                (no numbers)",
        differs: "`core` is what a stream has; the others are exact searches in f64",
        run: |e| literal::Args.evaluate(e),
        keys: (
            "part method option",
            "joint_error_cm variability third_difference shared step_error_ms duration_error contact_f1 \
             accuracy flickers",
        ),
        ..TABLE
    },
    Table {
        name: "Xia 2015, Figures 5 and 7: interpolated styles and neighbors, drawn",
        paper: "the polygon of styles, and the three nearest neighbors of inputs that are unlike the database",
        differs: "drawn on generated motion; distances are ours",
        run: |e| sheets::Args::default().evaluate(e),
        keys: ("sheet place", "between_cm input_cm nearest_cm"),
        ..TABLE
    },
    Table {
        name: "Xia 2015, section 7.1: heterogeneous streams, motion graphs",
        paper: "high-quality animation for unlabelled walks, runs, jumps, punches and kicks in one stream (video)",
        differs: "ten minutes that a motion graph makes of held-out clips; recognition is ours",
        run: |e| transitions::Args::default().evaluate(e),
        keys: (
            "part since action attribute recognised yaw",
            "share error_cm alone_cm unchanged_cm far degraded action_right style_right action_delay_s \
             style_delay_s",
        ),
        ..TABLE
    },
    Table {
        name: "Xia 2015, section 7.3: across actions",
        paper: "a database of walks or of runs translates the other action and jumps (video)",
        differs: "input that is unlike the database is passed through by default, and flagged `far`",
        run: |e| cross::Args::default().evaluate(e),
        keys: ("method part database", "delivered_error_cm unchanged_error_cm over_unchanged far"),
        ..TABLE
    },
    Table {
        name: "Xia 2015, section 7.4: components",
        paper: "the bias term and its value, mixture against local models (video)",
        differs: "on held-out clips of the database's kind, not on motion outside of it",
        run: |e| ablation::Args::default().evaluate(e),
        keys: ("parameter value method", ERRORS),
        long: true,
        ..TABLE
    },
    Table {
        name: "Xia 2015, section 6: contacts",
        paper: "KNN classification of footplants with Gaussian smoothing (no numbers)",
        differs: "votes by each foot's own leg, not smoothed; truth is kinematic for captured clips and the generator's for \
                  generated ones",
        run: |e| contacts::Args.evaluate(e),
        keys: ("part method", "contact_f1 accuracy planted_f1 flickers changes_over_truth"),
        ..TABLE
    },
    Table {
        name: "Xia 2015, section 6: foot skate after inverse kinematics",
        paper: "foot skate is removed (video)",
        differs: "the lock is causal",
        run: |e| skate::Args.evaluate(e),
        keys: ("method", "skate_cm_s skate_counterpart_cm_s joint_speed_ratio"),
        ..TABLE
    },
    Table {
        name: "Xia 2015, section 5.1: output time",
        paper: "poses at predicted times (Figure 4 draws one clip)",
        differs: "two more policies: one pose a tick, within bounds of the input or with its steps",
        run: |e| timing::Args::default().evaluate(e),
        keys: ("method", "step_error_ms duration_error lag_s_max lead_s_max"),
        ..TABLE
    },
    Table {
        name: "Hsu 2005, Figure 2 and section 5.1: correspondence",
        paper: "iterative motion warping is better than dynamic time warping, which stalls (one figure, no numbers)",
        differs: "errors at right strikes and on pairs whose warp is known",
        run: |e| correspondence::Args.evaluate(e),
        keys: ("data method", "strike_error_ms error_frames stalled"),
        ..TABLE
    },
    Table {
        name: "Torresani 2006, Table 1: Effort",
        paper: "mean squared error of Effort over 500 random splits, labelled by an analyst; sequences segmented correctly",
        differs: "Efforts are estimated from the motion or those of a simulated annotator: nobody labelled the data. `generated-first` is \
                  the annotator as it first was; `-pair` are our kernels",
        run: |e| effort::Args::estimated(100).evaluate(e),
        keys: ("part corpus streams factor method", "mse gain right rank_correlation"),
        numbers: &[
            ("flow linear-interpolation", "mse", 0.65),
            ("flow linear-ridge", "mse", 1.03),
            ("flow kernel-ridge", "mse", 0.50),
            ("flow support-vector", "mse", 0.48),
            ("weight linear-interpolation", "mse", 0.97),
            ("weight linear-ridge", "mse", 1.04),
            ("weight kernel-ridge", "mse", 0.39),
            ("weight support-vector", "mse", 0.48),
            ("time linear-interpolation", "mse", 1.01),
            ("time linear-ridge", "mse", 1.01),
            ("time kernel-ridge", "mse", 0.60),
            ("time support-vector", "mse", 0.61),
        ],
        long: true,
    },
    Table {
        name: "Measures of later papers (MoST, SMooDi, Style-ERD)",
        paper: "content and style by classifiers, Fréchet motion distance, skating ratio",
        differs: "features and classifiers are this page's, since theirs are networks trained on other skeletons: figures do \
                  not compare with theirs",
        run: |e| field::Args::default().evaluate(e),
        keys: ("method", "content style_right style_across fmd skating_ratio jerk_ratio"),
        ..TABLE
    },
    Table {
        name: "Hsu 2005, section 5.2 and Figure 4: deviations",
        paper: "stepping over an obstacle, ducking, limboing: unpredictable without the blend, though recovered from very \
                rapidly, kept with it; 98 states at 10,000 frames a second on a Pentium 4 (video, and these numbers)",
        differs: "the deviations are made by rule on held-out walks and runs; `lti-paper` is the paper's model, on the host",
        run: |e| deviations::Args.evaluate(e),
        keys: (
            "method deviation",
            "kept off_cm deviation_cm after_cm recovery_cycles recovered passed third_difference states \
             frames_per_s",
        ),
        numbers: &[("lti-paper none", "states", 98.0), ("lti-paper none", "frames_per_s", 10_000.0)],
        ..TABLE
    },
    Table {
        name: "Hsu 2005, section 5.1: bilinear analysis of style and speed",
        paper: "looped walks of any style and speed, interpolated and extrapolated (video)",
        differs: "held against real cycles at speeds that were left out of the model; `gestus loop` makes the walks",
        run: |e| bilinear::Args.evaluate(e),
        keys: ("part method", "error_cm duration_error speed_ratio"),
        ..TABLE
    },
    Table {
        name: "Statistical style transfer with quaternions, Table 1 and Figure 2",
        paper: "four pairs: time warping 300 to 900 ms, transfer 10 to 21 ms, post-processing 22 to 80 ms on a Pentium 4; \
                Euler angles give unnatural results (one picture)",
        differs: "other clips, and another machine; `transfer` weighs frames by the warp, `transfer-literal` is the paper's \
                  reverse time warp; Figure 2 on generated motion at the pole of its angles",
        run: |e| transfer::Args.evaluate(e),
        keys: (
            "part method pair",
            "delivered_error_cm delivered_third_difference from_ours_deg frames reference_frames warp_ms \
             transfer_ms clean_up_ms arm_speed_ratio arm_third_difference",
        ),
        ..TABLE
    },
];
