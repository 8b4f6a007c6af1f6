//! Robots that move: legged, wheeled and flying, beside the stream that a simulator of them puts out.

pub mod deviation;
pub mod flying;
pub mod jet;
pub mod legged;
pub mod motion;
pub mod route;
pub mod trajectory;
pub mod wheeled;

pub use self::{
    motion::RobotMotion,
    trajectory::{RobotKind, Trajectory},
};
