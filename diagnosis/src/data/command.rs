//! The valve's command between the rows of a log whose controller is faster: a row has one command, and others follow it that are not
//! in the log.

use super::split::interrupted;
use core::ops::Range;

/// A controller that gives several commands from one row to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FasterLoop {
    /// How many commands; infinite for one that moves all the time.
    pub(crate) per_row: f64,
    /// What those are like that are not in the log.
    pub(crate) missing: Missing,
}

/// What commands that are not in the log are like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Missing {
    /// On the line from one row to the next: a command that moves steadily.
    OnTheLine,
    /// Those of so many rows before and behind, each as likely: a command that jitters, as that of a controller that amplifies its
    /// sensors' noise or jumps over a dead zone. The mean opening of the valve is the mean of theirs, and what one row jitters by does
    /// not count for the whole interval.
    LikeRows(usize),
}

/// Commands in V, each from its time in s on.
#[derive(Clone, Debug, Default)]
pub(crate) struct Steps {
    pub(crate) t_s: Vec<f64>,
    pub(crate) u_v: Vec<f64>,
}

/// In how many parts a line is taken at most: its levels are an eighth of the way from one row to the next off.
const PARTS: usize = 4;
/// How many rows nearby are taken at most, evenly spread: their mean jitters by a quarter of what one row does, so that what it drives comes
/// out a sixteenth too weak at most.
const MOST_ROWS: usize = 16;

impl FasterLoop {
    /// The commands of some rows, and between them those that are likely.
    pub(crate) fn steps(&self, t_s: &[f64], u_v: &[f64], usual_s: f64) -> Steps {
        let mut out = Steps::default();
        let starts = (0..u_v.len()).filter(|k| *k == 0 || interrupted(t_s, *k, usual_s));
        let starts: Vec<usize> = starts.chain([u_v.len()]).collect();
        for piece in starts.windows(2) {
            self.piece((t_s, u_v), piece[0]..piece[1], &mut out);
        }
        out
    }

    /// Of rows without an interruption.
    fn piece(&self, (t_s, u_v): (&[f64], &[f64]), rows: Range<usize>, out: &mut Steps) {
        let known = 1.0 / self.per_row;
        let parts = match self.missing {
            Missing::OnTheLine => PARTS.min((self.per_row - 1.0).ceil() as usize).max(1),
            Missing::LikeRows(near) => (2 * near).min(MOST_ROWS),
        };
        for k in rows.clone() {
            let (from, last) = (t_s[k], k + 1 == rows.end);
            if last || known > 0.0 {
                out.t_s.push(from);
                out.u_v.push(u_v[k]);
            }
            if last {
                continue;
            }
            for part in 0..parts {
                let place = |of: f64| known + (1.0 - known) * of / parts as f64;
                let command = match self.missing {
                    // Held commands come after the line by half the time for which they are held.
                    Missing::OnTheLine => u_v[k] + (u_v[k + 1] - u_v[k]) * (place(part as f64 + 0.5) - 0.5 * known),
                    Missing::LikeRows(near) => {
                        let stride = 2 * near / parts;
                        // Of even strides the middle is half a row off, one way and the other in turns.
                        let first = if stride > 1 { stride / 2 - k % 2 } else { 0 };
                        u_v[(k + 1 + first + stride * part).saturating_sub(near).clamp(rows.start, rows.end - 1)]
                    }
                };
                out.t_s.push(from + (t_s[k + 1] - from) * place(part as f64));
                out.u_v.push(command);
            }
        }
    }
}

impl Steps {
    /// Their mean from each of some times to the next, the last one lasting `usual_s`.
    pub(crate) fn means(&self, t_s: &[f64], usual_s: f64) -> Vec<f64> {
        let mut at = 0;
        let mean = |k: usize| {
            let (from, to) = (t_s[k], t_s.get(k + 1).map_or(t_s[k] + usual_s, |next| next.min(t_s[k] + usual_s)));
            while at + 1 < self.t_s.len() && self.t_s[at + 1] <= from {
                at += 1;
            }
            let (mut sum, mut here, mut step) = (0.0, from, at);
            while here < to {
                let until = self.t_s.get(step + 1).map_or(to, |next| next.min(to));
                sum += self.u_v[step] * (until - here);
                (here, step) = (until, step + 1);
            }
            if to > from { sum / (to - from) } else { self.u_v[at] }
        };
        if self.u_v.is_empty() { Vec::new() } else { (0..t_s.len()).map(mean).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand::distr::{Distribution, StandardUniform};
    use rand::rngs::Xoshiro256PlusPlus;

    fn rows(count: i32) -> Vec<f64> {
        (0..count).map(|k| 0.01 * f64::from(k)).collect()
    }

    #[test]
    fn without_jitter_held_commands_are_those_of_a_controller_with_as_many() {
        let t_s = rows(20);
        let of = |t: f64| 0.5 + 30.0 * t;
        let u_v: Vec<f64> = t_s.iter().map(|t| of(*t)).collect();
        let missing = Missing::OnTheLine;
        for per_row in [2.0, 5.0, 10.0, f64::INFINITY] {
            let steps = FasterLoop { per_row, missing }.steps(&t_s, &u_v, 0.01);
            let means = steps.means(&t_s, 0.01);
            for (t, mean) in t_s.iter().zip(&means).take(19) {
                // The mean of a staircase with so many steps from one row to the next.
                let expected = of(*t) + 30.0 * 0.01 * 0.5 * (1.0 - 1.0 / per_row);
                assert!((mean - expected).abs() < 1.0e-12, "{per_row}: {mean} {expected}");
            }
        }
    }

    #[test]
    fn jitter_of_a_row_counts_as_long_as_its_command_is_held() {
        let t_s = rows(2001);
        // Two commands a row, of which one is in the log.
        let ticks: Vec<f64> = StandardUniform
            .sample_iter(Xoshiro256PlusPlus::seed_from_u64(1))
            .take(4002)
            .map(|x: f64| x - 0.5)
            .collect();
        let u_v: Vec<f64> = (0..2001).map(|k| ticks[2 * k]).collect();
        let truth: Vec<f64> = (0..2001).map(|k| 0.5 * (ticks[2 * k] + ticks[2 * k + 1])).collect();
        // How much a change of what is read changes the truth by: one for a reading that does not bias what it drives.
        let slope = |missing: Missing| {
            let means = FasterLoop { per_row: 2.0, missing }.steps(&t_s, &u_v, 0.01).means(&t_s, 0.01);
            let product = |of: &[f64]| means.iter().zip(of).map(|(mean, of)| mean * of).sum::<f64>();
            product(&truth) / product(&means)
        };
        let [line, few, many] = [Missing::OnTheLine, Missing::LikeRows(1), Missing::LikeRows(8)].map(slope);
        assert!(line < 0.85 && few < 0.85 && (many - 1.0).abs() < 0.1, "{line} {few} {many}");
    }

    #[test]
    fn nothing_reaches_across_an_interruption() {
        let t_s = [0.0, 0.01, 0.02, 0.5, 0.51];
        let u_v = [1.0, 1.0, 1.0, 3.0, 3.0];
        let steps = FasterLoop { per_row: 2.0, missing: Missing::LikeRows(2) }.steps(&t_s, &u_v, 0.01);
        assert!(steps.u_v.iter().all(|u| *u == 1.0 || *u == 3.0));
        assert_eq!(steps.means(&t_s, 0.01), u_v);
    }
}
