//! Attitudes that are held more than once: without them nothing tells how well a rest repeats.

use nalgebra::{Matrix3, Rotation3};

use crate::simulator::Motion;

/// The movement is looked at this often, s.
const STEP: f64 = 0.1;
/// It rests below this rate, rad/s, for at least so long, s.
const STILL: f64 = 3e-3;
const SHORTEST: f64 = 1.0;
/// Rests within this angle of each other are in one attitude, rad.
const SAME: f64 = 0.02;

/// What a recording without revisits costs; `None` where an attitude is held again after another, or nothing rests.
pub fn remark(motion: &dyn Motion) -> Option<String> {
    let rests = rests(motion);
    let again = |at: usize, rest: &Matrix3<f64>| {
        let earlier = rests[..at.saturating_sub(1)].iter();
        earlier
            .map(|other| Rotation3::from_matrix_unchecked(other.tr_mul(rest)).angle())
            .any(|angle| angle < SAME)
    };
    let revisits = rests.iter().enumerate().filter(|(at, rest)| again(*at, rest)).count();
    (revisits == 0 && !rests.is_empty()).then(|| {
        format!(
            "none of {} rests is a revisit of an earlier attitude: how well a rest repeats, and what drifts, is told by \
             the fit alone, so that an effect that differs from rest to rest may pass for scatter; hold some attitudes \
             twice, minutes apart",
            rests.len()
        )
    })
}

/// Attitude in the middle of each rest, table to base.
fn rests(motion: &dyn Motion) -> Vec<Matrix3<f64>> {
    let steps = (motion.duration() / STEP) as usize;
    let truth = |step: usize| motion.truth(step as f64 * STEP, &|_| ());
    let still: Vec<bool> = (0..=steps).map(|step| truth(step).w_pt_t.norm() < STILL).collect();
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
    use crate::simulator::{Place, Programme};

    #[test]
    fn a_programme_with_revisits_has_no_remark() {
        let schedule = |duration| {
            Programme::MultiPosition
                .schedule(crate::simulator::Simulation::default().axes, 1, duration, Place::ankara())
                .unwrap()
        };
        assert_eq!(remark(&schedule(None)), None);
        assert!(rests(&schedule(None)).len() >= 30);
    }

    #[test]
    fn a_movement_that_ends_before_it_comes_back_is_remarked() {
        struct Half<M>(M);
        impl<M: Motion> Motion for Half<M> {
            fn duration(&self) -> f64 {
                30.0
            }
            fn truth(&self, time: f64, rig: &dyn Fn(&mut crate::effect::Machine)) -> crate::effect::Truth {
                self.0.truth(time, rig)
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
        assert!(remark(&Half(schedule)).unwrap().contains("hold some attitudes twice"));
    }
}
