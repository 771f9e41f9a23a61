//! The table of sections: number, name, presence, and what `cut --models-only` does with it.
//!
//! A section is a line of the table, and nothing else lists them all. Core and builder keep one value for each section in
//! a [`Required`] or an [`Optional`], whose literals and patterns name every field: a required section without a length
//! or an encoder does not compile, nor does an optional one without a check.

macro_rules! sections {
    (
        required { $( $(#[$about:meta])* $field:ident: $ID:ident = $id:literal, kept $kept:literal; )* }
        optional { $( $(#[$more:meta])* $part:ident: $PART:ident = $number:literal, kept $cut:literal; )* }
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

        /// True for a section whose content stays in a blob that is cut to its models. A required section that does
        /// not stay is there and empty.
        pub const fn is_kept_by_cut(id: u16) -> bool {
            match id {
                $( $ID => $kept, )*
                $( $PART => $cut, )*
                _ => false,
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
        manifest: MANIFEST = 1, kept true;
        /// Joints and, behind them, the skeleton's trailer: see [`joint`](super::joint).
        skeleton: SKELETON = 2, kept true;
        /// Per dof: quantisation step and scale: see [`dof_record`](super::dof_record).
        dofs: DOFS = 3, kept true;
        /// Mean cloud, alignment weights, feature groups and scales, principal components: see [`query`](super::query).
        /// A cut keeps it where there are tables by phase, which read it.
        query: QUERY = 4, kept true;
        /// Classes: see [`class`](super::class). A cut keeps their labels where there are tables by phase.
        classes: CLASSES = 5, kept true;
        /// Clips, runs of rows that follow each other in time: see [`clip`](super::clip).
        clips: CLIPS = 6, kept false;
        /// Cycles: see [`cycle`](super::cycle).
        cycles: CYCLES = 7, kept false;
        /// Time knots of the cycles, f32.
        knots: KNOTS = 8, kept false;
        /// Per cycle and style: the cycle that is its output, u16.
        pairs: PAIRS = 9, kept false;
        /// Per block of rows: where it starts, u32.
        blocks: BLOCKS = 10, kept false;
        /// Packed rows: see [`block`](super::block).
        rows: ROWS = 11, kept false;
        /// Per captured frame: its feature, i8.
        features: FEATURES = 12, kept false;
        /// Per captured frame: [`DEGREE`](super::DEGREE) edges, u16. May be empty.
        graph: GRAPH = 13, kept false;
        /// Per captured frame: its contacts, and whether the search may return it: see [`flag`](super::flag).
        flags: FLAGS = 14, kept false;
        /// Dofs and weights of the timing metric: see [`timing`](super::timing).
        timing: TIMING = 15, kept false;
    }
    optional {
        /// Linear time-invariant models (Hsu 2005): see [`lti`](super::lti).
        lti: LTI = 32, kept true;
        /// Means and spreads of joint rotations (statistical transfer): see [`statistic`](super::statistic).
        statistic: STATISTIC = 33, kept true;
        /// The effort dial (Torresani 2006): see [`effort`](super::effort).
        effort: EFFORT = 34, kept true;
        /// A retargeting map: see [`retarget::layout`](crate::retarget::layout).
        retarget: RETARGET = 35, kept true;
        /// Legs, and the heights of ankle and toes on the floor: see [`foot`](super::foot).
        feet: FEET = 36, kept true;
        /// Tables by phase: see [`phase`](super::phase).
        phase: PHASE = 38, kept true;
        /// How fast distances fall, and norms of the features: see [`distances`](super::distances).
        distances: DISTANCES = 39, kept false;
        /// How near and how fast input of each class is: see [`trust`](super::trust).
        trust: TRUST = 40, kept true;
    }
    separate {
        /// A robot, always a file of its own: see [`robot::layout`](crate::robot::layout). The number is what its
        /// errors carry; a database has no such section.
        robot: ROBOT = 37;
    }
}
