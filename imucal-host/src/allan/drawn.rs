//! Noise of known coefficients, to try the estimates on.

use nalgebra::Vector3;

use super::cascade::Cascade;
use crate::simulator::random::{Purpose, Random};

/// Correlation times of the Gauss–Markov processes that 1/f noise is drawn as grow by this factor.
const RATIO: f64 = 3.0;
/// The shortest of them, samples, and how many there are.
const SHORTEST: f64 = 0.1;
const PROCESSES: i32 = 17;

/// Coefficients of a triad's noise, unit in samples; all axes alike.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drawn {
    /// Q.
    pub quantisation: f64,
    /// N.
    pub white: f64,
    /// B.
    pub flicker: f64,
    /// K.
    pub walk: f64,
    /// σ and T of a Gauss–Markov bias.
    pub markov: Option<(f64, f64)>,
}

/// One sample after another.
#[derive(Clone, Debug)]
pub struct Source {
    drawn: Drawn,
    random: Random,
    /// What was quantised away before.
    carried: Vector3<f64>,
    walk: Vector3<f64>,
    processes: Vec<Process>,
}

/// A Gauss–Markov process, of which a sample is the mean over its interval.
#[derive(Clone, Debug)]
struct Process {
    state: Vector3<f64>,
    /// What a sample keeps of the state, and what the next state does.
    mean: f64,
    kept: f64,
    /// Factors of two normal numbers: the next state takes one, the sample's mean both.
    step: f64,
    shared: f64,
    own: f64,
}

impl Process {
    /// Of a standard deviation and a correlation time, samples; stationary.
    fn new(sigma: f64, time: f64, random: &mut Random) -> Self {
        let kept = (-1.0 / time).exp();
        let lost = -(-1.0 / time).exp_m1();
        let step = sigma * (1.0 - kept * kept).sqrt();
        // Moments of a state and of its integral over one sample.
        let variance = sigma * sigma * time * time * (2.0 / time - 2.0 * lost - lost * lost);
        let shared = sigma * sigma * time * lost * lost / step;
        let own = (variance - shared * shared).max(0.0).sqrt();
        Self { state: random.normals() * sigma, mean: time * lost, kept, step, shared, own }
    }

    fn sample(&mut self, random: &mut Random) -> Vector3<f64> {
        let fresh = random.normals();
        let mean = self.state * self.mean + fresh * self.shared + random.normals() * self.own;
        self.state = self.state * self.kept + fresh * self.step;
        mean
    }
}

impl Source {
    /// From a seed.
    pub fn new(drawn: Drawn, seed: u64) -> Self {
        let mut random = Random::new(seed, Purpose::Noise);
        // The sum's density is that of B within a percent: h = σ² / ln r for 1/f, and σ²(m) = 2 ln 2 · h.
        let each = drawn.flicker * (RATIO.ln() / std::f64::consts::PI).sqrt();
        let flicker =
            (0..PROCESSES).map(|k| (each, SHORTEST * RATIO.powi(k))).filter(|(each, _)| *each > 0.0);
        let processes =
            flicker.chain(drawn.markov).map(|(sigma, time)| Process::new(sigma, time, &mut random)).collect();
        let carried = random.normals() * drawn.quantisation;
        Self { drawn, random, carried, walk: Vector3::zeros(), processes }
    }

    /// The next sample.
    pub fn sample(&mut self) -> Vector3<f64> {
        let random = &mut self.random;
        let mut sample = random.normals() * self.drawn.white + self.walk;
        if self.drawn.quantisation > 0.0 {
            let now = random.normals() * self.drawn.quantisation;
            sample += now - self.carried;
            self.carried = now;
        }
        if self.drawn.walk > 0.0 {
            self.walk += random.normals() * self.drawn.walk;
        }
        for process in &mut self.processes {
            sample += process.sample(random);
        }
        sample
    }
}

/// So many samples of a seed, summed up.
pub fn cascade(rows: usize, drawn: Drawn, seed: u64) -> Cascade {
    let mut source = Source::new(drawn, seed);
    let mut cascade = Cascade::default();
    (0..rows).for_each(|_| cascade.push(&source.sample()));
    cascade
}
