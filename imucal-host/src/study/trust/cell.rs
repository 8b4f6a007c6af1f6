//! The grid of the study's hand recordings: noise × rests × coverage × quality.

use crate::simulator::random::Random;

/// What the samples' noise is like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Noise {
    /// White; a rest's direction and a turn's angle are about as well known as each other.
    White,
    /// White; rests' directions are the larger part of a turn's error.
    NoisyAccelerometer,
    /// White; the gyroscope's noise is the larger part of a turn's error.
    NoisyGyroscope,
    /// White and 1/f.
    Flicker,
    /// White and smaller than a step of the converter.
    CoarseSteps,
}

/// How many rests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rests {
    /// 12 to 15: few degrees of freedom are left.
    Few,
    /// 20 to 30.
    Some,
    /// 45 to 60.
    Many,
}

/// Which directions are seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coverage {
    /// The whole sphere.
    Whole,
    /// A cap of 65° to 100° about an axis of the sensor.
    Cap,
}

/// How good sensor and hand are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quality {
    /// Rests of 4 s, and noise as of an MTx.
    Good,
    /// Rests of 2.2 s, and four times the noise.
    Poor,
}

/// A cell of the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cell {
    /// Noise.
    pub noise: Noise,
    /// Rests.
    pub rests: Rests,
    /// Coverage.
    pub coverage: Coverage,
    /// Quality.
    pub quality: Quality,
}

impl Cell {
    /// Every cell, in a fixed order: 60.
    pub fn grid() -> Vec<Self> {
        let mut cells = Vec::new();
        for noise in Noise::ALL {
            for rests in [Rests::Few, Rests::Some, Rests::Many] {
                for coverage in [Coverage::Whole, Coverage::Cap] {
                    for quality in [Quality::Good, Quality::Poor] {
                        cells.push(Self { noise, rests, coverage, quality });
                    }
                }
            }
        }
        cells
    }
}

impl Noise {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::White, Self::NoisyAccelerometer, Self::NoisyGyroscope, Self::Flicker, Self::CoarseSteps];

    /// Its name in the table.
    pub fn name(self) -> &'static str {
        match self {
            Self::White => "white",
            Self::NoisyAccelerometer => "noisy acc",
            Self::NoisyGyroscope => "noisy gyr",
            Self::Flicker => "white and 1/f",
            Self::CoarseSteps => "coarse steps",
        }
    }

    /// White noise of accelerometer, gyroscope and magnetometer against the usual.
    pub(super) fn white(self) -> [f64; 3] {
        match self {
            Self::NoisyAccelerometer => [4.0, 0.25, 1.0],
            Self::NoisyGyroscope => [0.25, 8.0, 1.0],
            Self::White | Self::Flicker | Self::CoarseSteps => [1.0; 3],
        }
    }
}

impl Rests {
    /// Its name in the table.
    pub fn name(self) -> &'static str {
        match self {
            Self::Few => "12 to 15",
            Self::Some => "20 to 30",
            Self::Many => "45 to 60",
        }
    }

    pub(super) fn draw(self, random: &mut Random) -> usize {
        match self {
            Self::Few => 12 + random.below(4),
            Self::Some => 20 + random.below(11),
            Self::Many => 45 + random.below(16),
        }
    }
}

impl Coverage {
    /// Its name in the table.
    pub fn name(self) -> &'static str {
        match self {
            Self::Whole => "sphere",
            Self::Cap => "cap",
        }
    }
}

impl Quality {
    /// Its name in the table.
    pub fn name(self) -> &'static str {
        match self {
            Self::Good => "good",
            Self::Poor => "poor",
        }
    }

    /// White noise against the usual.
    pub(super) fn white(self) -> f64 {
        match self {
            Self::Good => 1.0,
            Self::Poor => 4.0,
        }
    }

    /// The first rest, the others and the turns, s.
    pub(super) fn durations(self) -> (f64, f64, f64) {
        match self {
            Self::Good => (8.0, 4.0, 2.0),
            Self::Poor => (6.0, 2.2, 1.5),
        }
    }
}
