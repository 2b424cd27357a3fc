//! What a rig file says that hardly any rig is: mostly another unit, or positions that do not count from mid-stroke.

use crate::rig_file::RigFile;
use plant_model::Short;

/// A chamber at mid-stroke holds at least the half stroke; a tenth less is within tolerance.
const LEAST_FILLING: f64 = 0.9;
/// A chamber with as many half strokes as this is no cylinder's, but a volume in another unit.
const MOST_FILLING: f64 = 50.0;
/// The middle of the position sensor may lie this part of the stroke off mid-stroke.
const OFF_CENTRE: f64 = 0.25;

impl RigFile {
    /// Sentences about values that can be, but hardly are: a volume in another unit, a position that counts from an end stop.
    #[must_use]
    pub fn suspicions(&self) -> Vec<String> {
        let (c, mut found) = (&self.rig.cylinder, Vec::new());
        for (key, volume, area) in
            [("volume_a0_m3", c.volume_a0_m3, c.area_a_m2), ("volume_b0_m3", c.volume_b0_m3, c.area_b_m2)]
        {
            let swept = 0.5 * area * c.stroke_m;
            let than = if volume < LEAST_FILLING * swept {
                "less than"
            } else if volume > MOST_FILLING * swept {
                "far more than"
            } else {
                continue;
            };
            found.push(format!(
                "`cylinder.{key}` = {volume:e} m3 is {than} the {swept:.2e} m3 that the piston sweeps up to mid-stroke: is it \
                 the whole chamber, in m3? 1 cm3 is 1e-6 m3, 1 l is 1e-3 m3"
            ));
        }
        let [low, high] = self.io.position_range_m;
        let middle = 0.5 * (low + high);
        if middle.abs() > OFF_CENTRE * c.stroke_m {
            let [low, high, middle, from, to] = [low, high, middle, low - middle, high - middle].map(Short);
            found.push(format!(
                "`io.position_range_m` = [{low}, {high}] has its middle at {middle} m, but positions count from mid-stroke: a \
                 sensor that reads {low} to {high} m from an end stop has the range [{from}, {to}]"
            ));
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_volume_a_thousand_times_off_and_a_range_from_the_end_stop_are_questioned() {
        let rig = RigFile::paper_a();
        assert_eq!(rig.suspicions(), Vec::<String>::new());
        for factor in [1.0e-3, 1.0e3] {
            let mut off = rig.clone();
            off.rig.cylinder.volume_b0_m3 *= factor;
            let said = off.suspicions();
            assert!(said.len() == 1 && said[0].contains("`cylinder.volume_b0_m3`"), "{said:?}");
        }
        let mut off = rig;
        off.io.position_range_m = [0.0, 1.0];
        assert!(off.suspicions()[0].contains("[-0.5, 0.5]"), "{:?}", off.suspicions());
    }
}
