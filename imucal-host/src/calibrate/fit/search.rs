//! How a gyroscope's optimum is reached: Levenberg–Marquardt from the start; where that ends badly, a particle swarm
//! around the start, and Levenberg–Marquardt from its best. The better of the two ends is kept.

use imucal_core::{
    model::{Cost, Model},
    solver::{
        LevenbergMarquardt, Termination,
        lm::Settings,
        swarm::{self, Bounds, Swarm},
    },
};
use nalgebra::SVector;
use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
use rayon::prelude::*;

/// Particles of a swarm.
const PARTICLES: usize = 40;
/// Observations that a swarm looks at, the shortest: a basin needs no more.
pub const SWARM_OBSERVATIONS: usize = 20;

/// How a fit was reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// Why Levenberg–Marquardt from the start stopped, and the rms residual it left, rad.
    pub direct: (Termination, f64),
    /// The swarm, where one was sent out.
    pub swarm: Option<Swarmed>,
}

/// What a swarm came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swarmed {
    /// Why it stopped: by its spread it has converged, by its iterations it has not in the budget it had.
    pub termination: Termination,
    /// Iterations, and costs worked out.
    pub iterations: u16,
    /// See `iterations`.
    pub evaluations: u32,
    /// Largest distance of a particle from the best, as a share of the range.
    pub spread: f64,
    /// Parameters of its best at a bound: where there are some, the bounds may exclude the truth.
    pub at_bound: usize,
    /// Rms residual after Levenberg–Marquardt from its best, rad.
    pub rms: f64,
    /// Its end is the one that was kept.
    pub kept: bool,
}

impl Search {
    /// In words.
    pub fn note(&self) -> String {
        let (termination, rms) = self.direct;
        let residual = |rms: f64| match rms.is_nan() {
            true => "no residual".to_owned(),
            false => format!("{:.2}° rms", rms.to_degrees()),
        };
        let direct = format!("by {}, {}", termination.name(), residual(rms));
        let Some(swarm) = &self.swarm else {
            return "found by Levenberg–Marquardt from the static bias".into();
        };
        let converged = if swarm.termination.was_successful() {
            format!("drew together in {} iterations", swarm.iterations)
        } else {
            format!(
                "had not drawn together after its {} iterations (spread {:.1} % of the range)",
                swarm.iterations,
                100.0 * swarm.spread
            )
        };
        let bound = match swarm.at_bound {
            0 => String::new(),
            count => {
                format!("; {count} parameters of its best are at their bounds, which may exclude the truth")
            }
        };
        let end =
            if swarm.kept { "and Levenberg–Marquardt from its best is kept" } else { "and ended no lower" };
        format!(
            "Levenberg–Marquardt from the static bias stopped {direct}; a particle swarm {converged}, \
             {} evaluations{bound}, {end}: {}",
            swarm.evaluations,
            residual(swarm.rms)
        )
    }
}

/// What is searched: the model of all observations, a cost of some of them, and what is left.
pub struct Searched<'a, M, C, const P: usize> {
    /// All observations.
    pub model: &'a M,
    /// Those that a swarm looks at.
    pub cost: &'a C,
    /// Where to start, and how far a swarm looks to either side.
    pub start: SVector<f64, P>,
    /// See `start`.
    pub reach: SVector<f64, P>,
    /// Rms residual, rad.
    pub rms: &'a dyn Fn(&SVector<f64, P>) -> f64,
    /// A larger one is no minimum to stay in, rad.
    pub limit: f64,
}

impl<M: Model<f64, P>, C: Cost<f64, P> + Sync, const P: usize> Searched<'_, M, C, P> {
    /// The better end, and how it was reached.
    pub fn solve(&self) -> (LevenbergMarquardt<f64, P>, Search) {
        let (direct, first) = self.polish(self.start);
        let mut search = Search { direct: (direct.report().termination, first), swarm: None };
        if direct.report().termination.was_successful() && first <= self.limit {
            return (direct, search);
        }
        let Some((polished, mut swarm)) = self.swarm() else { return (direct, search) };
        // NaN of the first is worse than anything.
        swarm.kept = swarm.rms < first || first.is_nan();
        search.swarm = Some(swarm);
        (if swarm.kept { polished } else { direct }, search)
    }

    /// A swarm's best, polished; `None` where no particle has a finite cost.
    pub fn swarm(&self) -> Option<(LevenbergMarquardt<f64, P>, Swarmed)> {
        let bounds = Bounds::around(&self.start, &self.reach)?;
        let mut swarm = Swarm::<f64, PARTICLES, P, C::State>::new(bounds, swarm::Settings::default());
        // The same recording gives the same answer, on any number of cores.
        let report = swarm.run_ahead(&mut ChaCha8Rng::seed_from_u64(1), |positions, values| {
            let costs = positions.par_iter().zip(values);
            costs.for_each(|(theta, value)| *value = self.cost.cost(theta));
        });
        let (polished, rms) = self.polish(*swarm.best());
        let found = Swarmed {
            termination: report.termination?,
            iterations: report.iterations,
            evaluations: report.evaluations,
            spread: report.spread,
            at_bound: swarm.minimum_at_bound().iter().flatten().count(),
            rms,
            kept: true,
        };
        (found.termination != Termination::NotFinite).then_some((polished, found))
    }

    fn polish(&self, from: SVector<f64, P>) -> (LevenbergMarquardt<f64, P>, f64) {
        let mut solver = LevenbergMarquardt::new(from, Settings::default());
        solver.run(self.model);
        let rms = (self.rms)(solver.theta());
        (solver, rms)
    }
}

#[cfg(test)]
mod tests {
    use imucal_core::model::RowSink;

    use super::*;

    /// A sine with a slope: Levenberg–Marquardt from zero stops in the dip next to it, below is another.
    struct Dips;

    impl Model<f64, 1> for Dips {
        fn rows<S: RowSink<f64, 1>>(&self, theta: &SVector<f64, 1>, sink: &mut S) {
            let x = theta.x;
            let residual = 1.5 - libm::sin(5.0 * x) + 0.1 * (x - 3.0) * (x - 3.0);
            sink.row(residual, &SVector::from([-5.0 * libm::cos(5.0 * x) + 0.2 * (x - 3.0)]));
        }

        fn independent_rows(&self) -> usize {
            2
        }
    }

    /// What cannot draw together: the cost does not say where.
    struct Flat;

    impl Cost<f64, 1> for Flat {
        type State = ();

        fn begin(&self, _: &SVector<f64, 1>) {}

        fn advance(&self, theta: &SVector<f64, 1>, (): &mut (), _: &mut usize) -> Option<f64> {
            Some(if theta.x > 2.4 { 1.0 - 1e-3 * libm::sin(1e6 * theta.x) } else { 2.0 })
        }
    }

    #[test]
    fn a_swarm_that_has_not_drawn_together_is_said_and_the_better_end_is_kept() {
        let residual = |theta: &SVector<f64, 1>| {
            let mut sum = imucal_core::model::SquaredSum(0.0);
            Dips.rows(theta, &mut sum);
            sum.0.sqrt()
        };
        let searched = Searched {
            model: &Dips,
            cost: &Flat,
            start: SVector::from([0.3]),
            reach: SVector::from([4.0]),
            rms: &residual,
            limit: 0.55,
        };
        let (solver, search) = searched.solve();
        let swarm = search.swarm.unwrap();
        println!("{}", search.note());
        // Whatever became of the swarm, the lower end is kept.
        assert_eq!(residual(solver.theta()), swarm.rms.min(search.direct.1));
        assert_eq!(swarm.kept, swarm.rms < search.direct.1);
        let unsettled = Swarmed { termination: Termination::Iterations, spread: 0.25, at_bound: 2, ..swarm };
        let note = Search { swarm: Some(unsettled), ..search }.note();
        for part in
            ["had not drawn together", "25.0 % of the range", "2 parameters", "evaluations", "is kept"]
        {
            assert!(note.contains(part), "{note}");
        }
    }
}
