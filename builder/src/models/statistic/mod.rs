//! Statistical transfer (paper 002).
