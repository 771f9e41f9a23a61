//! The bytes of a blob, by name: the only place where the format's numbers are written down in code. The
//! builder writes with these constants, [`Database`](super::Database) reads with them; `docs/FORMAT.md` explains.
//!
//! ```text
//! 0              64                    64 + 16 n          (16-byte boundaries)
//! | header       | section table       | section | section | ...             |
//! | magic, counts| id, offset, len, crc| raw bytes, little-endian, no pointers|
//! ```

use core::ops::Range;

/// First bytes of every blob.
pub const MAGIC: [u8; 8] = *b"GESTUS\r\n";
/// Version of the format that this core reads.
pub const VERSION: u16 = 1;
/// Every section starts on a multiple of this.
pub const ALIGNMENT: usize = 16;
/// Explicit graph edges of a frame. The frames before and after it are edges too, and not stored.
pub const DEGREE: usize = 8;
/// Entry points of a class's graph.
pub const ENTRIES: usize = 12;
/// An edge, entry point or pair that is not there.
pub const NONE: u16 = u16::MAX;
/// Most joints a database may have.
pub const MAX_JOINTS: usize = 64;
/// Most frames of a query window.
pub const MAX_WINDOW: usize = 8;
/// Most principal components of a feature.
pub const MAX_FEATURES: usize = 32;
/// Most joint groups of the metric and the style strength.
pub const MAX_GROUPS: usize = 8;
/// Most styles.
pub const MAX_STYLES: usize = 32;
/// Most actions.
pub const MAX_ACTIONS: usize = 256;
/// Most dofs that the timing metric looks at.
pub const MAX_TIMING: usize = 10;
/// Dofs that are not a joint's exponential map: height, forward, left, yaw.
pub const ROOT_DOFS: usize = 4;

/// Index of each root dof; the joints' exponential maps follow, three a joint, joints in order from 1.
pub mod dof {
    /// Height of the root above the floor, metres.
    pub const HEIGHT: usize = 0;
    /// Root orientation without its heading, relative to its mean: an exponential map, radians, three dofs.
    pub const TILT: usize = 1;
    /// Root velocity along the heading of the frame before, metres a second.
    pub const FORWARD: usize = 4;
    /// Root velocity to the left of that heading, metres a second.
    pub const LEFT: usize = 5;
    /// Rate of the heading, radians a second, positive to the left.
    pub const YAW: usize = 6;
    /// First dof of joint 1.
    pub const JOINTS: usize = 7;
}

/// Byte ranges of the header (64 bytes).
pub mod header {
    use super::Range;
    /// Length of the header.
    pub const LENGTH: usize = 64;
    /// [`MAGIC`](super::MAGIC).
    pub const MAGIC: Range<usize> = 0..8;
    /// Format version, u16.
    pub const VERSION: Range<usize> = 8..10;
    /// Number of sections, u16.
    pub const SECTIONS: Range<usize> = 10..12;
    /// Length of the whole blob in bytes, u32.
    pub const TOTAL: Range<usize> = 12..16;
    /// CRC-32C of header and section table, with these four bytes zero.
    pub const CRC: Range<usize> = 16..20;
    /// Joints, u16.
    pub const JOINTS: Range<usize> = 20..22;
    /// Degrees of freedom: 3 joints + 4, u16.
    pub const DOFS: Range<usize> = 22..24;
    /// Principal components of a feature, u16.
    pub const FEATURES: Range<usize> = 24..26;
    /// Frames of the query window, u16.
    pub const WINDOW: Range<usize> = 26..28;
    /// Styles, u16.
    pub const STYLES: Range<usize> = 28..30;
    /// Actions, u16.
    pub const ACTIONS: Range<usize> = 30..32;
    /// Classes (combinations of action and style that hold frames), u16.
    pub const CLASSES: Range<usize> = 32..34;
    /// Joint groups, u16.
    pub const GROUPS: Range<usize> = 34..36;
    /// Captured frames, u32.
    pub const FRAMES: Range<usize> = 36..40;
    /// Rows: captured frames and, behind them, prototype frames, u32.
    pub const ROWS: Range<usize> = 40..44;
    /// Frames a second, f32.
    pub const RATE: Range<usize> = 44..48;
    /// Rows of a block, u16.
    pub const BLOCK_ROWS: Range<usize> = 48..50;
    /// Dofs of the timing metric, u16.
    pub const TIMING: Range<usize> = 50..52;
    /// Gait cycles or whole-clip segments, u32.
    pub const CYCLES: Range<usize> = 52..56;
    /// Clips, u32.
    pub const CLIPS: Range<usize> = 56..60;
    /// Zero.
    pub const RESERVED: Range<usize> = 60..64;
}

/// Byte ranges of an entry of the section table (16 bytes).
pub mod entry {
    use super::Range;
    /// Length of an entry.
    pub const LENGTH: usize = 16;
    /// Section number, u16.
    pub const ID: Range<usize> = 0..2;
    /// Zero.
    pub const RESERVED: Range<usize> = 2..4;
    /// Offset from the start of the blob, u32.
    pub const OFFSET: Range<usize> = 4..8;
    /// Length in bytes without padding, u32.
    pub const BYTES: Range<usize> = 8..12;
    /// CRC-32C of the section's bytes.
    pub const CRC: Range<usize> = 12..16;
}

/// Numbers of the sections.
pub mod section {
    /// Names, licences, build parameters: postcard.
    pub const MANIFEST: u16 = 1;
    /// Joints and, behind them, the skeleton's trailer.
    pub const SKELETON: u16 = 2;
    /// Per dof: quantisation step and scale.
    pub const DOFS: u16 = 3;
    /// Mean cloud, alignment weights, feature groups and scales, principal components: see [`query`](super::query).
    pub const QUERY: u16 = 4;
    /// Classes.
    pub const CLASSES: u16 = 5;
    /// Clips: runs of rows that follow each other in time.
    pub const CLIPS: u16 = 6;
    /// Cycles.
    pub const CYCLES: u16 = 7;
    /// Time knots of the cycles, f32.
    pub const KNOTS: u16 = 8;
    /// Per cycle and style: the cycle that is its output, u16.
    pub const PAIRS: u16 = 9;
    /// Per block of rows: where it starts, u32.
    pub const BLOCKS: u16 = 10;
    /// Packed rows.
    pub const ROWS: u16 = 11;
    /// Per captured frame: its feature, i8.
    pub const FEATURES: u16 = 12;
    /// Per captured frame: [`DEGREE`](super::DEGREE) edges, u16.
    pub const GRAPH: u16 = 13;
    /// Per captured frame: contacts and what it may be used for, u8.
    pub const FLAGS: u16 = 14;
    /// Dofs and weights of the timing metric.
    pub const TIMING: u16 = 15;
    /// The sections that every database has, in the order in which they are written.
    pub const REQUIRED: [u16; 15] = [
        MANIFEST, SKELETON, DOFS, QUERY, CLASSES, CLIPS, CYCLES, KNOTS, PAIRS, BLOCKS, ROWS, FEATURES, GRAPH,
        FLAGS, TIMING,
    ];
    /// Linear time-invariant models (paper 001): see [`lti`](super::lti).
    pub const LTI: u16 = 32;
    /// Tables of statistical transfer (paper 002): see [`statistic`](super::statistic).
    pub const STATISTIC: u16 = 33;
    /// The effort dial (paper 003): see [`effort`](super::effort).
    pub const EFFORT: u16 = 34;
    /// Retargeting maps, in a blob of their own: see [`retarget::layout`](crate::retarget::layout).
    pub const RETARGET: u16 = 35;
    /// Legs: joints from hip to toe, and how high ankle and toe are over the floor of a foot that stands.
    pub const FEET: u16 = 36;
    /// Robots, in a blob of their own: see [`robot::layout`](crate::robot::layout).
    pub const ROBOT: u16 = 37;
    /// The sections that a blob may have besides, in the order in which they are written.
    pub const OPTIONAL: [u16; 5] = [LTI, STATISTIC, EFFORT, RETARGET, FEET];

    /// Name of a section, for people.
    pub const fn name(id: u16) -> Option<&'static str> {
        Some(match id {
            MANIFEST => "manifest",
            SKELETON => "skeleton",
            DOFS => "dofs",
            QUERY => "query",
            CLASSES => "classes",
            CLIPS => "clips",
            CYCLES => "cycles",
            KNOTS => "knots",
            PAIRS => "pairs",
            BLOCKS => "blocks",
            ROWS => "rows",
            FEATURES => "features",
            GRAPH => "graph",
            FLAGS => "flags",
            TIMING => "timing",
            LTI => "lti",
            STATISTIC => "statistic",
            EFFORT => "effort",
            RETARGET => "retarget",
            FEET => "feet",
            ROBOT => "robot",
            _ => return None,
        })
    }
}

/// Byte ranges of a joint (32 bytes) and of the trailer behind the joints (16 bytes).
pub mod joint {
    use super::Range;
    /// Length of a joint.
    pub const LENGTH: usize = 32;
    /// Index of the parent, u8; [`ROOT`] for joint 0.
    pub const PARENT: usize = 0;
    /// Joint group, u8.
    pub const GROUP: usize = 1;
    /// Zero.
    pub const RESERVED: Range<usize> = 2..4;
    /// Position in the parent's frame, metres, 3 f32.
    pub const OFFSET: Range<usize> = 4..16;
    /// Mean local rotation, quaternion, 4 f32.
    pub const MEAN: Range<usize> = 16..32;
    /// The parent of joint 0.
    pub const ROOT: u8 = 255;
    /// Length of the trailer.
    pub const TRAILER: usize = 16;
    /// In the trailer: the hips line, from right to left, in the root's own frame, unit length, 3 f32.
    pub const HIPS_LINE: Range<usize> = 0..12;
    /// In the trailer: joints of the left and right toes, u8 each (255: none), then zero.
    pub const TOES: Range<usize> = 12..14;
}

/// Byte ranges of a dof (8 bytes).
pub mod dof_record {
    use super::Range;
    /// Length of a dof.
    pub const LENGTH: usize = 8;
    /// Quantisation step, f32, in the dof's unit.
    pub const STEP: Range<usize> = 0..4;
    /// Standard deviation over the database, f32, in the dof's unit: scale of the normalised ridge.
    pub const SCALE: Range<usize> = 4..8;
}

/// Places in the query section, by the header's counts. All numbers f32 but the groups.
///
/// ```text
/// mean cloud  [window][joints][3]   metres, oldest frame first, ground centroid at the origin, facing +Z
/// weights     [joints]              of the alignment; 0 for joints that it leaves out
/// scales      [features]            metres for one step of a stored i8
/// groups      [features] u8         joint group of each feature, padded with zeros to a multiple of 4
/// components  [features][window][joints of the group][3]
/// ```
pub mod query {
    /// Where the alignment weights start.
    pub const fn weights(window: usize, joints: usize) -> usize {
        12 * window * joints
    }

    /// Where the feature scales start.
    pub const fn scales(window: usize, joints: usize) -> usize {
        weights(window, joints) + 4 * joints
    }

    /// Where the feature groups start.
    pub const fn groups(window: usize, joints: usize, features: usize) -> usize {
        scales(window, joints) + 4 * features
    }

    /// Where the components start.
    pub const fn components(window: usize, joints: usize, features: usize) -> usize {
        groups(window, joints, features) + features.next_multiple_of(4)
    }
}

/// Byte ranges of a class (48 bytes).
pub mod class {
    use super::Range;
    /// Length of a class.
    pub const LENGTH: usize = 48;
    /// First row, u32.
    pub const FIRST_ROW: Range<usize> = 0..4;
    /// Number of rows, at most 65,535, u32.
    pub const ROWS: Range<usize> = 4..8;
    /// First cycle, u32.
    pub const FIRST_CYCLE: Range<usize> = 8..12;
    /// Number of cycles, u32.
    pub const CYCLES: Range<usize> = 12..16;
    /// Action, u16.
    pub const ACTION: Range<usize> = 16..18;
    /// Style, u16.
    pub const STYLE: Range<usize> = 18..20;
    /// Most neighbors that a search of this class returns, u16.
    pub const K_CAP: Range<usize> = 20..22;
    /// Rows that the search may return, u16.
    pub const SEARCHABLE: Range<usize> = 22..24;
    /// Entry points of the graph, [`ENTRIES`](super::ENTRIES) u16, rows of the class.
    pub const ENTRY_POINTS: Range<usize> = 24..48;
}

/// Byte ranges of a clip (8 bytes).
pub mod clip {
    use super::Range;
    /// Length of a clip.
    pub const LENGTH: usize = 8;
    /// First row, u32.
    pub const FIRST_ROW: Range<usize> = 0..4;
    /// Number of rows, u32.
    pub const ROWS: Range<usize> = 4..8;
}

/// Byte ranges of a cycle (16 bytes).
pub mod cycle {
    use super::Range;
    /// Length of a cycle.
    pub const LENGTH: usize = 16;
    /// The clip it lies in, u32.
    pub const CLIP: Range<usize> = 0..4;
    /// Its first knot, u32.
    pub const FIRST_KNOT: Range<usize> = 4..8;
    /// Number of knots, at least 2, u16.
    pub const KNOTS: Range<usize> = 8..10;
    /// Zero.
    pub const RESERVED: Range<usize> = 10..12;
    /// First row of the cycle, u32: the first knot, rounded up. Cycles of a class ascend in it.
    pub const START: Range<usize> = 12..16;
}

/// Byte ranges of a block's header; the packed rows follow it. Blocks follow each other, on even offsets.
pub mod block {
    use super::Range;
    /// Bytes of a row, u16.
    pub const ROW_BYTES: Range<usize> = 0..2;
    /// First of the bases: one i16 a dof, in quantisation steps. Behind them one bit width a dof, two a byte.
    pub const BASES: usize = 2;
    /// Widest field of a row, bits.
    pub const MAX_WIDTH: usize = 15;
    /// Zero bytes behind the last block, so that a field can be read whole.
    pub const PADDING: usize = 4;

    /// Length of the header of a block with that many dofs.
    pub const fn header(dofs: usize) -> usize {
        BASES + 2 * dofs + dofs.div_ceil(2)
    }
}

/// Bits of a frame's flags.
pub mod flag {
    /// The left foot stands.
    pub const LEFT_CONTACT: u8 = 1;
    /// The right foot stands.
    pub const RIGHT_CONTACT: u8 = 2;
    /// The search may return the frame: it has a frame before it and an output in every style.
    pub const SEARCHABLE: u8 = 4;
    /// The row before it is the frame before it.
    pub const FOLLOWS: u8 = 8;
    /// All bits in use.
    pub const ALL: u8 = 15;
}

/// Byte ranges of a dof of the timing metric (12 bytes).
pub mod timing {
    use super::Range;
    /// Length of an entry.
    pub const LENGTH: usize = 12;
    /// The dof, u16.
    pub const DOF: Range<usize> = 0..2;
    /// Zero.
    pub const RESERVED: Range<usize> = 2..4;
    /// Weight of squared differences of the dof, f32.
    pub const POSE: Range<usize> = 4..8;
    /// Weight of squared differences of its change from frame to frame, f32.
    pub const CHANGE: Range<usize> = 8..12;
}

/// Byte ranges of a leg (16 bytes) in the feet section: left, then right.
pub mod foot {
    use super::Range;
    /// Length of a leg's record.
    pub const LENGTH: usize = 16;
    /// The joint that turns the thigh, u8. Each of the next three joints is a child of the one before.
    pub const HIP: usize = 0;
    /// The knee, u8.
    pub const KNEE: usize = 1;
    /// The ankle, u8.
    pub const ANKLE: usize = 2;
    /// The toes, u8; [`NO_TOE`] where the skeleton has none.
    pub const TOE: usize = 3;
    /// No toes.
    pub const NO_TOE: u8 = 255;
    /// Height of the ankle over the floor where the foot stands on its heel or flat, metres, f32.
    pub const ANKLE_HEIGHT: Range<usize> = 4..8;
    /// Height of the toes over the floor where the foot stands on them or flat, metres, f32; 0 without toes.
    pub const TOE_HEIGHT: Range<usize> = 8..12;
    /// Zero.
    pub const RESERVED: Range<usize> = 12..16;
}

/// Most states of one unit of a linear model.
pub const MAX_ORDER: usize = 8;

/// Byte ranges of the section of linear time-invariant models.
///
/// ```text
/// header      16 bytes
/// directory   16 bytes a model
/// models      each: dofs [D][4] f32, step [2] f32, feet [2][1 + states] f32, units
/// unit        8 bytes, then A [n][n], B [n][m], C [p][n], D [p][m], f32, row by row
/// ```
pub mod lti {
    use super::Range;
    /// Length of the header.
    pub const HEADER: usize = 16;
    /// Style that the models take, u16.
    pub const FROM: Range<usize> = 0..2;
    /// Number of models, u16.
    pub const MODELS: Range<usize> = 2..4;
    /// Zero.
    pub const RESERVED: Range<usize> = 4..16;
    /// Length of an entry of the directory. Models lie side by side behind it, in its order.
    pub const ENTRY: usize = 16;
    /// In an entry: style that the model gives, u16.
    pub const STYLE: Range<usize> = 0..2;
    /// In an entry: action that it was estimated from, u16; [`NONE`](super::NONE): all.
    pub const ACTION: Range<usize> = 2..4;
    /// In an entry: number of units, u16.
    pub const UNITS: Range<usize> = 4..6;
    /// In an entry: states of all units together, u16.
    pub const STATES: Range<usize> = 6..8;
    /// In an entry: where the model starts, from the start of the section, u32.
    pub const OFFSET: Range<usize> = 8..12;
    /// In an entry: bytes of the model, u32.
    pub const BYTES: Range<usize> = 12..16;
    /// Length of a dof: mean and standard deviation of the input, then of the output.
    pub const DOF: usize = 16;
    /// Length of a unit's header.
    pub const UNIT: usize = 8;
    /// In a unit: states n, u8.
    pub const ORDER: usize = 0;
    /// In a unit: inputs m, u8, 1 to 4.
    pub const INPUTS: usize = 1;
    /// In a unit: outputs p, u8, 1 to 4.
    pub const OUTPUTS: usize = 2;
    /// In a unit: zero.
    pub const UNIT_RESERVED: usize = 3;
    /// In a unit: first input dof, u16; the others follow it.
    pub const FIRST_INPUT: Range<usize> = 4..6;
    /// In a unit: first output dof, u16; the others follow it. Dof D is the logarithm of the time warp.
    pub const FIRST_OUTPUT: Range<usize> = 6..8;

    /// Where the time step's mean and deviation are in a model.
    pub const fn step(dofs: usize) -> usize {
        DOF * dofs
    }

    /// Where the footplants are: for the left, then the right foot, the boundary and the projection of the states.
    pub const fn feet(dofs: usize) -> usize {
        step(dofs) + 8
    }

    /// Where the units are.
    pub const fn units(dofs: usize, states: usize) -> usize {
        feet(dofs) + 8 * (1 + states)
    }

    /// Numbers of a unit with n states, m inputs and p outputs.
    pub const fn numbers(n: usize, m: usize, p: usize) -> usize {
        (n + p) * (n + m)
    }
}

/// Byte ranges of the section of statistical transfer.
///
/// ```text
/// header   16 bytes
/// tables   each: 16 bytes, root [3][2] f32, feet [2][1 + D] f32, joints [J][5] f32
/// ```
pub mod statistic {
    use super::Range;
    /// Length of the header.
    pub const HEADER: usize = 16;
    /// Style whose statistics stand for the input's where it is not labelled, u16.
    pub const FROM: Range<usize> = 0..2;
    /// Number of tables, u16.
    pub const TABLES: Range<usize> = 2..4;
    /// Zero.
    pub const RESERVED: Range<usize> = 4..16;
    /// In a table: its style, u16.
    pub const STYLE: Range<usize> = 0..2;
    /// In a table: its action, u16; [`NONE`](super::NONE): all.
    pub const ACTION: Range<usize> = 2..4;
    /// In a table: zero.
    pub const TABLE_RESERVED: Range<usize> = 4..16;
    /// Mean and standard deviation of height, forward and left velocity.
    pub const ROOT: usize = 16;
    /// For the left, then the right foot: boundary and projection of the dofs.
    pub const FEET: usize = ROOT + 24;
    /// Length of a joint: mean rotation, quaternion, and standard deviation, radians.
    pub const JOINT: usize = 20;

    /// Where the joints are in a table.
    pub const fn joints(dofs: usize) -> usize {
        FEET + 8 * (1 + dofs)
    }

    /// Length of a table.
    pub const fn length(joints: usize) -> usize {
        self::joints(super::dofs(joints)) + JOINT * joints
    }
}

/// Places in the effort section.
///
/// ```text
/// nodes   [3] u16           of the grid along flow, weight and time
/// labels  u8, reserved u8
/// axes    [3][2] f32        least and greatest value of each factor
/// rest    [3] f32           the factors where nobody turns them
/// efforts [styles][3] f32   flow, weight and time of each style
/// table   [flow][weight][time][styles] u8   weights of the styles, of sum 255
/// ```
pub mod effort {
    use super::Range;
    /// Nodes along each axis, u16, 2 to [`MAX_NODES`].
    pub const NODES: Range<usize> = 0..6;
    /// Where the labels come from, u8: [`ESTIMATED`] or [`GIVEN`].
    pub const LABELS: usize = 6;
    /// Zero.
    pub const RESERVED: Range<usize> = 7..8;
    /// Ends of the axes, f32, low and high of each.
    pub const AXES: Range<usize> = 8..32;
    /// Effort at rest, 3 f32.
    pub const REST: Range<usize> = 32..44;
    /// Length of a style's Effort.
    pub const STYLE_LENGTH: usize = 12;
    /// Most nodes along an axis.
    pub const MAX_NODES: usize = 33;
    /// The styles' Efforts were estimated from the motion.
    pub const ESTIMATED: u8 = 0;
    /// The styles' Efforts were given by people.
    pub const GIVEN: u8 = 1;
    /// What the weights of a node add up to.
    pub const WHOLE: u16 = 255;

    /// Where the styles' Efforts start.
    pub const fn styles() -> usize {
        REST.end
    }

    /// Where the table starts.
    pub const fn table(styles: usize) -> usize {
        self::styles() + styles * STYLE_LENGTH
    }
}

/// Degrees of freedom of a skeleton with that many joints.
pub const fn dofs(joints: usize) -> usize {
    3 * joints + ROOT_DOFS
}

const _: () = {
    // The counts in the records add up to their lengths.
    assert!(class::ENTRY_POINTS.end - class::ENTRY_POINTS.start == 2 * ENTRIES);
    assert!(header::RESERVED.end == header::LENGTH);
    assert!(dof::JOINTS == ROOT_DOFS + 3);
    assert!(dofs(MAX_JOINTS) <= 4 * MAX_JOINTS);
};
