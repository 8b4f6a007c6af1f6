//! The score of trials with robots as a table for people.

use super::score::RobotScore;
use crate::blind::table::{head, line};

impl RobotScore {
    /// The table, its lines ended.
    pub fn table(&self) -> String {
        let [healthy, afflicted] = self.trials;
        let mut text = format!(
            "{healthy} healthy and {afflicted} afflicted pairs of a robot and its simulator;\n95 % intervals of Clopper and Pearson.\n\n"
        );
        text += &head();
        self.shares.iter().for_each(|share| text += &line(share));
        text += "\nFurther figures:\n";
        self.further.iter().for_each(|share| text += &line(share));
        let [median, largest] = self.seconds;
        text +=
            &format!("\nTime of a diagnosis on one thread: median {median:.1} s, largest {largest:.1} s.\n");
        text
    }
}
