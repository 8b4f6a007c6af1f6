//! Ellipsoids through clouds of points: where a geometric fit starts from, and what it is compared with.

pub mod adjusted;
pub mod calibrated_norm;
pub mod direct;
pub mod distance;
pub mod li_griffiths;
pub mod quadric;
pub mod sphere;
