//! Ellipsoids through clouds of points: where a geometric fit starts from.

pub mod adjusted;
pub mod sphere;
