//! The table of sections: number, name, presence, and what `cut --models-only` does with it.
//!
//! A section is a line of the table, and nothing else lists them all. Core and builder keep one value for each section in
//! a [`Required`] or an [`Optional`], whose literals and patterns name every field: a required section without a length
//! or an encoder does not compile, nor does an optional one without a check.

/// When a blob that is cut to its models keeps the content of a section.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Kept {
    /// Always.
    Always,
    /// Where it keeps phase tables: no other model has classes or looks at features.
    WithPhase,
    /// Never.
    Never,
}

macro_rules! sections {
    (
        required { $( $(#[$about:meta])* $field:ident: $ID:ident = $id:literal, kept $kept:ident; )* }
        optional { $( $(#[$more:meta])* $part:ident: $PART:ident = $number:literal, kept $cut:ident; )* }
        separate { $( $(#[$other:meta])* $file:ident: $FILE:ident = $own:literal; )* }
    ) => {
        $( $(#[$about])* pub const $ID: u16 = $id; )*
        $( $(#[$more])* pub const $PART: u16 = $number; )*
        $( $(#[$other])* pub const $FILE: u16 = $own; )*

        /// The sections that every database has, in the order in which they are written.
        pub const REQUIRED: [u16; [$($id),*].len()] = [$($ID),*];
        /// The sections that a database may have, by number. They are written behind the required ones, in any order.
        pub const OPTIONAL: [u16; [$($number),*].len()] = [$($PART),*];

        /// Name of a section: what `gestus inspect` and errors print.
        pub const fn name(id: u16) -> Option<&'static str> {
            match id {
                $( $ID => Some(stringify!($field)), )*
                $( $PART => Some(stringify!($part)), )*
                $( $FILE => Some(stringify!($file)), )*
                _ => None,
            }
        }

        /// When a blob that is cut to its models keeps the content of a section. A required section that is not kept is there
        /// and empty.
        pub const fn kept_by_cut(id: u16) -> Kept {
            match id {
                $( $ID => Kept::$kept, )*
                $( $PART => Kept::$cut, )*
                _ => Kept::Never,
            }
        }

        /// One value for each required section, in the order of [`REQUIRED`].
        #[derive(Debug, Clone, Copy)]
        pub struct Required<T> {
            $( $(#[$about])* pub $field: T, )*
        }

        impl<T> Required<T> {
            /// From values in the order of [`REQUIRED`].
            #[inline]
            pub fn from_array([$($field),*]: [T; REQUIRED.len()]) -> Self {
                Self { $($field),* }
            }

            /// Number and value of each, in the order of [`REQUIRED`].
            #[inline]
            pub fn numbered(self) -> [(u16, T); REQUIRED.len()] {
                [$(($ID, self.$field)),*]
            }
        }

        /// One value for each optional section, in the order of [`OPTIONAL`].
        #[derive(Debug, Clone, Copy)]
        pub struct Optional<T> {
            $( $(#[$more])* pub $part: T, )*
        }

        impl<T> Optional<T> {
            /// From values in the order of [`OPTIONAL`].
            #[inline]
            pub fn from_array([$($part),*]: [T; OPTIONAL.len()]) -> Self {
                Self { $($part),* }
            }

            /// Number and value of each, in the order of [`OPTIONAL`].
            #[inline]
            pub fn numbered(self) -> [(u16, T); OPTIONAL.len()] {
                [$(($PART, self.$part)),*]
            }
        }
    };
}

sections! {
    required {
        /// Names, licences, build parameters: postcard. A cut removes the names of clips.
        manifest: MANIFEST = 1, kept Always;
        /// Joints and, behind them, the skeleton's trailer: see [`joint`](super::joint).
        skeleton: SKELETON = 2, kept Always;
        /// Per dof: quantisation step and scale: see [`dof_record`](super::dof_record). Then, in blobs that store it, the
        /// range of each: see [`dof_range`](super::dof_range).
        dofs: DOFS = 3, kept Always;
        /// Mean cloud, alignment weights, feature groups and scales, principal components: see [`query`](super::query).
        query: QUERY = 4, kept WithPhase;
        /// Classes: see [`class`](super::class). A cut keeps their labels.
        classes: CLASSES = 5, kept WithPhase;
        /// Clips, runs of rows that follow each other in time: see [`clip`](super::clip).
        clips: CLIPS = 6, kept Never;
        /// Cycles: see [`cycle`](super::cycle).
        cycles: CYCLES = 7, kept Never;
        /// Time knots of the cycles, f32.
        knots: KNOTS = 8, kept Never;
        /// Per cycle and style: the cycle that is its output, u16.
        pairs: PAIRS = 9, kept Never;
        /// Per block of rows: where it starts, u32.
        blocks: BLOCKS = 10, kept Never;
        /// Packed rows: see [`block`](super::block).
        rows: ROWS = 11, kept Never;
        /// Per captured frame: its feature, i8.
        features: FEATURES = 12, kept Never;
        /// Per captured frame: [`DEGREE`](super::DEGREE) edges, u16. May be empty.
        graph: GRAPH = 13, kept Never;
        /// Per captured frame: its contacts, and whether the search may return it: see [`flag`](super::flag).
        flags: FLAGS = 14, kept Never;
        /// Dofs and weights of the timing metric: see [`timing`](super::timing).
        timing: TIMING = 15, kept Never;
    }
    optional {
        /// Linear time-invariant models (Hsu 2005): see [`lti`](super::lti).
        lti: LTI = 32, kept Always;
        /// Means and spreads of joint rotations (statistical transfer): see [`statistic`](super::statistic).
        statistic: STATISTIC = 33, kept Always;
        /// The effort dial (Torresani 2006): see [`effort`](super::effort).
        effort: EFFORT = 34, kept Always;
        /// A retargeting map: see [`retarget::layout`](crate::retarget::layout).
        retarget: RETARGET = 35, kept Always;
        /// Legs, and the heights of ankle and toes on the floor: see [`foot`](super::foot).
        feet: FEET = 36, kept Always;
        /// Phase tables: see [`phase`](super::phase).
        phase: PHASE = 38, kept Always;
        /// How fast distances fall, and norms of the features: see [`distances`](super::distances).
        distances: DISTANCES = 39, kept Never;
        /// How near and how fast input of each class is: see [`trust`](super::trust).
        trust: TRUST = 40, kept WithPhase;
    }
    separate {
        /// A robot, always a file of its own: see [`robot::layout`](crate::robot::layout). The number is what its
        /// errors carry; a database has no such section.
        robot: ROBOT = 37;
    }
}
