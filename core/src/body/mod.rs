//! A body: its pose as rotations and as degrees of freedom, where its joints are, and how a leg reaches.

pub mod kinematics;
pub mod pose;
pub mod two_bone_ik;
