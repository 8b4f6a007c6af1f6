//! Attitudes that are held more than once: without them nothing shows how well a rest repeats.

use nalgebra::{Matrix3, Rotation3};

use crate::simulator::Motion;

/// The movement is looked at this often, s.
const STEP: f64 = 0.1;
/// It rests below this rate, rad/s, for at least so long, s; what is shorter is a jerk.
const STILL: f64 = 3e-3;
const SHORTEST: f64 = 1.0;
/// Rests within this angle of each other are in one attitude, rad.
const SAME: f64 = 0.02;

/// What a recording without revisits costs; `None` where an attitude is held again after another, or nothing rests.
pub fn remark(motion: &dyn Motion) -> Option<String> {
    let rests = rests(motion);
    let same =
        |a: &Matrix3<f64>, b: &Matrix3<f64>| Rotation3::from_matrix_unchecked(a.tr_mul(b)).angle() < SAME;
    let again = |at: usize| rests[..at].iter().any(|earlier| same(earlier, &rests[at]));
    let revisits = (0..rests.len()).filter(|at| again(*at)).count();
    (revisits == 0 && !rests.is_empty()).then(|| {
        format!(
            "none of {} rests is a revisit of an earlier attitude: repeatability and drift are \
             estimated by the fit alone, so that an effect that differs from rest to rest may be taken for pointing \
             errors; hold some attitudes twice, minutes apart",
            rests.len()
        )
    })
}

/// Attitude in the middle of each rest, table to base. A jerk does not end a rest.
fn rests(motion: &dyn Motion) -> Vec<Matrix3<f64>> {
    let steps = (motion.duration() / STEP) as usize;
    let truth = |step: usize| motion.truth(step as f64 * STEP, &|_| ());
    let mut still: Vec<bool> = (0..=steps).map(|step| truth(step).w_pt_t.norm() < STILL).collect();
    let mut from = 0;
    let jerks: Vec<std::ops::Range<usize>> = still
        .chunk_by(|a, b| a == b)
        .map(|run| {
            from += run.len();
            from - run.len()..from
        })
        .filter(|run| !still[run.start] && run.len() as f64 * STEP < SHORTEST)
        .collect();
    jerks.into_iter().for_each(|jerk| still[jerk].fill(true));
    let mut rests = Vec::new();
    let mut from = 0;
    for run in still.chunk_by(|a, b| a == b) {
        if run[0] && run.len() as f64 * STEP >= SHORTEST {
            rests.push(truth(from + run.len() / 2).c_t_p);
        }
        from += run.len();
    }
    rests
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        effect::{Machine, Truth},
        simulator::{Place, Programme, recent::Recent},
    };

    #[test]
    fn a_programme_with_revisits_has_no_remark() {
        let schedule = |duration| {
            Programme::MultiPosition
                .schedule(crate::simulator::Simulation::default().axes, 1, duration, Place::ankara())
                .unwrap()
        };
        assert_eq!(remark(&schedule(None)), None);
        assert!(rests(&schedule(None)).len() >= 30);
        let axes = crate::simulator::Simulation::default().axes;
        // Its first attitude and its last are the same, and there is no other.
        let rates = Programme::Rates.schedule(axes, 3, Some(150.0), Place::ankara()).unwrap();
        assert_eq!(remark(&rates), None);
    }

    #[test]
    fn a_movement_that_ends_before_it_comes_back_is_remarked() {
        /// Its first 20 s: two rests.
        struct Beginning<M>(M);
        impl<M: Motion> Motion for Beginning<M> {
            fn duration(&self) -> f64 {
                20.0
            }
            fn truth_among(&self, time: f64, rig: &dyn Fn(&mut Machine), recent: &mut Recent) -> Truth {
                self.0.truth_among(time, rig, recent)
            }
            fn encoders(&self, time: f64) -> Option<[f64; 3]> {
                self.0.encoders(time)
            }
            fn rig(&self) -> crate::recording::manifest::Rig {
                self.0.rig()
            }
            fn place(&self) -> Place {
                self.0.place()
            }
        }
        let axes = crate::simulator::Simulation::default().axes;
        let schedule = Programme::MultiPosition.schedule(axes, 1, None, Place::ankara()).unwrap();
        assert!(remark(&Beginning(schedule)).unwrap().contains("hold some attitudes twice"));
    }
}
