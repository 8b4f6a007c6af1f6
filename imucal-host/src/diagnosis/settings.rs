//! All that a diagnosis weighs and compares, with what a larger value does.
//!
//! [`Settings::default`] is the preset of a rig with encoders; [`Settings::preset`] gives that of any source of the movement.
//! What differs between the sources stands in the presets alone: no other file asks which of them there is. Values were
//! chosen on simulated recordings (`imucal blind`), none on labelled ones.
//!
//! Not here: constants of an algorithm that change no answer, such as the steps of a solver, and shares of distributions.

mod presets;
mod source;

pub use self::source::{Provided, Source};
use crate::recording::SensorKind;

/// Settings of a diagnosis, stage by stage.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// What the source of the movement provides.
    pub source: Provided,
    /// How residuals are averaged and simulated.
    pub residual: ResidualSettings,
    /// How noise is estimated.
    pub noise: NoiseSettings,
    /// Where nonlinear parameters are looked for.
    pub library: LibrarySettings,
    /// The stepwise search for a set of effects.
    pub search: SearchSettings,
    /// Score tests against covariates.
    pub location: LocationSettings,
    /// What is asserted.
    pub verdict: VerdictSettings,
    /// Formulas for what no effect explains.
    pub proposal: ProposalSettings,
}

/// How residuals are averaged and simulated.
#[derive(Clone, Debug, PartialEq)]
pub struct ResidualSettings {
    /// Longest block while the sensor moves, s. Larger: less to compute, and brisk motion is averaged away.
    pub moving_block: f64,
    /// Longest block at rest, s. Larger: less to compute, and onsets are known less closely.
    pub resting_block: f64,
    /// Most blocks: those of a longer recording are longer, so that memory is bounded. Larger: more memory and time.
    pub most_blocks: usize,
    /// Longest rest whose blocks share one pointing error, s. Larger: creep of the table looks like drift.
    pub longest_rest: f64,
    /// Distance of the points at which derivatives are simulated in motion, s. Larger: faster, less exact.
    pub moving_points: f64,
    /// Likewise at rest, s.
    pub resting_points: f64,
    /// Most nodes of a block at which formulas are screened. Larger: more to compute, and brisk motion is seen better.
    pub sparse_points: usize,
    /// Points lie in gaps of the source too, since it is bridged closely enough for a derivative.
    pub points_in_gaps: bool,
    /// Blocks in which something is brought near a sensor are left out: a rig's own movement brings nothing near.
    pub leaves_out_passages: bool,
    /// At rest samples of a passage scatter by so many times the usual. Larger: fewer blocks are left out.
    pub passage_scatter: f64,
    /// In a passage the residual changes by so many times the usual. Larger: fewer blocks are left out.
    pub passage_change: f64,
    /// A sensor without a usable row stays: its samples may be in another unit.
    pub keeps_sensors_without_rows: bool,
    /// Sensors that one effect may alter by way of a movement that is reconstructed from them; those of the effect
    /// otherwise.
    pub coupled: Option<&'static [SensorKind]>,
    /// Samples count the less the more the machine shakes the sensor, block by block.
    pub weighs_vibration: bool,
    /// Stretches in which all sensors agree on a movement that the source does not have are left out and named.
    pub leaves_out_mismatch: bool,
}

/// How noise is estimated.
#[derive(Clone, Debug, PartialEq)]
pub struct NoiseSettings {
    /// Smallest pointing error that is looked for, rad; the largest is 10⁴ of it.
    pub least_scatter: f64,
    /// A movement's pointing error is another one after this time, s.
    pub longest_stretch: f64,
    /// Lengths of the groups of blocks whose second differences count as white noise where the source trembles; empty where
    /// neighbouring blocks alone do. Longer: more of a slow sway is white noise.
    pub sway: &'static [usize],
    /// Groups are compared only where all their blocks hold as many rows: on a rig, one with fewer has just left a rest.
    pub whole_blocks: bool,
    /// Distance of the instants between which drift goes on a straight line, s. Larger: faster; what changes within it is
    /// white noise or an effect.
    pub knots: f64,
    /// The table does not stand exactly as the source says: rests and movements have pointing errors.
    pub scatters: bool,
}

/// Where nonlinear parameters are looked for.
#[derive(Clone, Debug, PartialEq)]
pub struct LibrarySettings {
    /// Distance of instants on the grid, s, and as a share of the recording where that is more. Larger: faster; short
    /// episodes are missed.
    pub grid: (f64, f64),
    /// Instants of episodes are placed in a quieter noise, which is alike at rest and in motion: what a hand adds hides
    /// them.
    pub places_in_quiet_noise: bool,
}

/// The stepwise search for a set of effects.
#[derive(Clone, Debug, PartialEq)]
pub struct SearchSettings {
    /// Most effects in a set.
    pub most: usize,
    /// ln of the evidence that the first effect must add beyond its prior. Larger: fewer false alarms, fewer finds.
    pub first_gain: f64,
    /// Likewise for each further effect.
    pub further_gain: f64,
    /// Likewise for a change to as many effects.
    pub change_gain: f64,
    /// Sensors are fitted one after the other before they are fitted together: what a reference does not give is shared
    /// among them.
    pub staged_start: bool,
    /// Fits of the baseline, each with the noise that the last one left.
    pub settling: usize,
    /// Sets scored with a noise of their own at each step. Larger: slower, more thorough.
    pub screened: usize,
    /// Likewise for each sensor, of those that a quieter noise favours.
    pub screened_quiet: usize,
    /// Of the screened sets, those scored with all sensors jointly.
    pub scored: usize,
    /// A set whose screened ln of evidence is so far behind the present one is not scored.
    pub behind: f64,
    /// Effects tried in the place of another.
    pub replaced: usize,
    /// Effects of a sensor tried in pairs.
    pub paired: usize,
    /// Two effects at once are tried to be taken out: each may stand for a part of the other.
    pub removes_pairs: bool,
    /// Before another effect is added, those of a class are tried in each other's place: a clock that is fitted with the wrong
    /// one calls for effects that undo it.
    pub settles_classes: bool,
    /// Details of strong effects are fitted with their amplitudes: where a clock is fitted too, it would take them up.
    pub fits_details: bool,
}

/// Score tests against covariates.
#[derive(Clone, Debug, PartialEq)]
pub struct LocationSettings {
    /// A covariate is followed below this p-value, all tests counted. Larger: more places, more false ones.
    pub p_value: f64,
    /// A χ² statistic is divided by this, since white noise is known to a few per cent.
    pub caution: f64,
    /// Below this p-value in a quieter noise a covariate is tested again with a noise of its own.
    pub suspect: f64,
    /// So many suspects as slow as drift are tested again.
    pub slow_suspects: usize,
    /// And so many others.
    pub other_suspects: usize,
    /// ln of the evidence that half-waves of the time must add beyond other covariates: drift is no sum of two processes.
    pub time_gain: f64,
    /// Shortest period that is looked for, s.
    pub shortest_period: f64,
    /// A period stands out by this factor over the median of its neighbours.
    pub peak: f64,
}

/// What is asserted.
#[derive(Clone, Debug, PartialEq)]
pub struct VerdictSettings {
    /// Held-out blocks must confirm a cause, and its amplitude: evidence alone is overconfident where the source trembles.
    pub confirms_held_out: bool,
    /// A confirmed cause is large enough to matter: where the source trembles, a small one may be a part of that.
    pub only_material: bool,
    /// A cause explains more than what the residual of its sensors still follows: where the source has errors that the
    /// catalogue does not hold, a smaller effect may stand for a part of them.
    pub outweighs_remainder: bool,
    /// A cause closes at least this share of the whole gap, and, where it is not zero, surely a part of it.
    pub least_of_all: f64,
    /// What the source is off by, by sensor, m/s², rad/s and µT: a smaller cause of one sensor alone is not asserted. Zero where
    /// a rig or a simulator is exact. The field of a room changes by as much from place to place.
    pub reference_errors: [f64; 3],
    /// Share of its own sensors' gap that a confirmed cause closes at least.
    pub least_share: f64,
    /// Standard errors from zero of a confirmed cause's largest amplitude.
    pub amplitude_errors: f64,
    /// Standard errors are those of a jackknife over parts of the recording where these are larger: the source has errors that
    /// the model of the noise does not hold.
    pub errors_from_parts: bool,
    /// Standard errors from zero of a reference's clock offset that is named.
    pub clock_errors: f64,
    /// An episode that begins and ends with the movement within this time is not asserted, s.
    pub carried: f64,
    /// Whitened squared size of a signature that is found in four of five recordings.
    pub detectable: f64,
    /// Length of the stretches that are dealt to folds, s.
    pub fold_stretch: f64,
    /// Whitened squared size of an effect that the search may miss: the interval of a share closed is widened by it.
    pub unseen: f64,
    /// A remainder below this share of the gap does not matter.
    pub remainder: f64,
    /// Causes that close less than this share of the gap explain nothing.
    pub explains: f64,
    /// Probability that a credible set holds.
    pub credible: f64,
    /// Alternatives of a cause that are scored with a noise of their own.
    pub alternatives: usize,
    /// Rows that a fault has spoilt add to the gap; not where the movement is reconstructed from them.
    pub counts_faults: bool,
}

/// Formulas for what no effect explains.
#[derive(Clone, Debug, PartialEq)]
pub struct ProposalSettings {
    /// ln of the evidence that a formula must add beyond the number of those that were tried. Larger: fewer proposals.
    pub least_gain: f64,
    /// Share of what is left of its sensor's gap that it closes at least, on stretches that no fit has seen, by the lower end
    /// of the share's interval.
    pub least_share: f64,
    /// Standard errors from zero of its largest amplitude, at least.
    pub amplitude_errors: f64,
    /// An axis whose amplitude is fewer standard errors from zero is left out.
    pub kept_errors: f64,
    /// What the sensor still follows apart from it is at most this share of what it explains. Larger: more wrong formulas.
    pub remainder: f64,
    /// What changes its amplitude matters from this share of what it explains on: a fiftieth leaves it a correlation of 0.99
    /// with what is there. Larger: more wrong formulas; smaller: strong ones are refused for what a derivative misses.
    pub inconstancy: f64,
}

impl Default for ResidualSettings {
    /// That of a rig.
    fn default() -> Self {
        Self {
            moving_block: 0.1,
            resting_block: 0.5,
            most_blocks: 40_000,
            longest_rest: 10.0,
            moving_points: 0.045,
            sparse_points: 4,
            resting_points: 0.25,
            points_in_gaps: true,
            leaves_out_passages: false,
            passage_scatter: 5.0,
            passage_change: 8.0,
            keeps_sensors_without_rows: true,
            coupled: None,
            weighs_vibration: false,
            leaves_out_mismatch: false,
        }
    }
}

impl Default for NoiseSettings {
    /// That of a rig.
    fn default() -> Self {
        Self {
            least_scatter: 1e-7,
            longest_stretch: 20.0,
            sway: &[],
            whole_blocks: true,
            knots: 2.5,
            scatters: true,
        }
    }
}

impl Default for LibrarySettings {
    /// That of a rig.
    fn default() -> Self {
        Self { grid: (5.0, 1.0 / 60.0), places_in_quiet_noise: false }
    }
}

impl Default for SearchSettings {
    /// That of a rig.
    fn default() -> Self {
        Self {
            most: 3,
            first_gain: 0.5,
            further_gain: 0.0,
            change_gain: 0.5,
            staged_start: false,
            settling: 0,
            screened: 8,
            screened_quiet: 4,
            scored: 3,
            behind: 25.0,
            replaced: 5,
            paired: 8,
            removes_pairs: false,
            settles_classes: false,
            fits_details: false,
        }
    }
}

impl Default for LocationSettings {
    /// That of a rig.
    fn default() -> Self {
        Self {
            p_value: 0.01,
            caution: 1.1,
            suspect: 1e-9,
            slow_suspects: 2,
            other_suspects: 4,
            time_gain: 12.0,
            shortest_period: 4.0,
            peak: 12.0,
        }
    }
}

impl Default for ProposalSettings {
    /// That of any source.
    fn default() -> Self {
        Self {
            least_gain: 8.0,
            least_share: 0.5,
            amplitude_errors: 4.0,
            kept_errors: 2.0,
            remainder: 0.1,
            inconstancy: 0.02,
        }
    }
}

impl Default for VerdictSettings {
    /// That of a rig.
    fn default() -> Self {
        Self {
            confirms_held_out: false,
            only_material: false,
            outweighs_remainder: false,
            least_of_all: 0.0,
            reference_errors: [0.0; 3],
            least_share: 0.05,
            amplitude_errors: 2.0,
            errors_from_parts: false,
            clock_errors: 5.0,
            carried: 3.0,
            detectable: 25.0,
            fold_stretch: 3.0,
            unseen: 50.0,
            remainder: 0.05,
            explains: 0.2,
            credible: 0.95,
            alternatives: 5,
            counts_faults: true,
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self::preset(Source::Rig)
    }
}

#[cfg(test)]
mod tests;
