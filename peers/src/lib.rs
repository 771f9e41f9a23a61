//! The graph search of `gestus-core` against other nearest neighbor libraries, on the task that a stylizer has:
//! a stream of queries, and for each of them the 40 nearest frames of every class.
//!
//! [`setup`] makes the database and the streams, [`methods`] puts every library behind one trait, [`measure`]
//! finds how hard each has to search for the recall that core reaches, and times it. [`hnswlib`] runs a library of Python
//! beside them.

pub mod hnswlib;
pub mod measure;
pub mod methods;
pub mod setup;
