//! The search for a gyroscope's calibration: swarm, attitude model, and both together on a simulated rig.

mod attitude;
mod gyroscope;
mod rig;
mod swarm;
