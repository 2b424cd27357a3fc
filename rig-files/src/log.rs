//! The log: what was measured on a rig, by column.

use crate::error::InputError;
use crate::rig_file::RigFile;
use crate::table::{Expected, Table};
use crate::write::write_file;
use plant_model::Short;
use std::fmt::Write as _;
use std::path::Path;

/// The columns a log can have besides the time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Column {
    /// Valve command about mid position, before the dead zone, V.
    U,
    /// Piston position from mid-stroke, m.
    Y,
    /// Pressure in chamber A, Pa absolute.
    PA,
    /// Pressure in chamber B, Pa absolute.
    PB,
    /// Supply pressure, Pa absolute.
    PSup,
    /// Measured external force on the piston, positive along +y, N.
    FExt,
    /// Position setpoint, m.
    YRef,
    /// Velocity, m/s; written by `simulate`, known to no sensor.
    V,
    /// Bristle deflection, m; written by `simulate`.
    Z,
}

impl Column {
    /// All columns in the order they are written.
    pub const ALL: [Self; 9] =
        [Self::U, Self::Y, Self::PA, Self::PB, Self::PSup, Self::FExt, Self::YRef, Self::V, Self::Z];

    /// The header text.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::U => "u_v",
            Self::Y => "y_m",
            Self::PA => "p_a_pa",
            Self::PB => "p_b_pa",
            Self::PSup => "p_sup_pa",
            Self::FExt => "f_ext_n",
            Self::YRef => "y_ref_m",
            Self::V => "v_m_per_s",
            Self::Z => "z_m",
        }
    }
}

/// A recording. Every column has one value per time; NaN marks a missing sample. `None` means "not measured".
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Log {
    /// Time, s, strictly increasing.
    pub t_s: Vec<f64>,
    /// Piston position, m.
    pub y_m: Vec<f64>,
    /// Valve command, V.
    pub u_v: Option<Vec<f64>>,
    /// Pressure in chamber A, Pa absolute.
    pub p_a_pa: Option<Vec<f64>>,
    /// Pressure in chamber B, Pa absolute.
    pub p_b_pa: Option<Vec<f64>>,
    /// Supply pressure, Pa absolute.
    pub p_sup_pa: Option<Vec<f64>>,
    /// External force, N.
    pub f_ext_n: Option<Vec<f64>>,
    /// Setpoint, m.
    pub y_ref_m: Option<Vec<f64>>,
    /// Velocity, m/s (simulated logs only).
    pub v_m_per_s: Option<Vec<f64>>,
    /// Bristle deflection, m (simulated logs only).
    pub z_m: Option<Vec<f64>>,
}

/// A stretch without samples, in all columns (missing rows) or in one (blank fields).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// The column with blank fields; `None` for missing rows.
    pub column: Option<Column>,
    /// Last time before the gap, s.
    pub from_s: f64,
    /// First time after the gap, s.
    pub to_s: f64,
}

/// A step of time this many times the usual one is a gap.
const GAP_FACTOR: f64 = 2.5;

impl Log {
    /// Reads a log.
    ///
    /// # Errors
    /// See [`Table::parse`]; also a log with nothing but time and position.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let file = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|error| InputError::unreadable(&file, &error))?;
        Self::parse(bytes, &file)
    }

    /// Parses a log from the bytes of a file.
    ///
    /// # Errors
    /// As [`Log::read`].
    pub fn parse(bytes: Vec<u8>, file: &str) -> Result<Self, InputError> {
        let mut expected = vec![Expected { name: "t_s", required: true, blanks: false }];
        expected.extend(Column::ALL.map(|column| Expected {
            name: column.name(),
            required: column == Column::Y,
            blanks: true,
        }));
        let table = Table::parse(bytes, file, &expected)?;
        let mut columns = table.columns.into_iter();
        let mut log = Self { t_s: columns.next().flatten().unwrap_or_default(), ..Self::default() };
        for (column, values) in Column::ALL.into_iter().zip(columns) {
            // A column without a single sample was not measured.
            log.set(column, values.filter(|values| values.iter().any(|value| !value.is_nan())));
        }
        if log.y_m.is_empty() {
            let remedy = "record the position, or remove the empty column";
            return Err(InputError::new(file, "column `y_m` has no sample at all", remedy));
        }
        if !Column::ALL.into_iter().any(|column| column != Column::Y && log.column(column).is_some()) {
            let remedy = "add at least one of u_v, p_a_pa, p_b_pa, p_sup_pa, f_ext_n, y_ref_m";
            return Err(InputError::new(file, "has only time and position", remedy));
        }
        Ok(log)
    }

    /// The values of a column, `None` if it was not measured.
    #[must_use]
    pub fn column(&self, column: Column) -> Option<&[f64]> {
        match column {
            Column::Y => (!self.y_m.is_empty()).then_some(&self.y_m[..]),
            Column::U => self.u_v.as_deref(),
            Column::PA => self.p_a_pa.as_deref(),
            Column::PB => self.p_b_pa.as_deref(),
            Column::PSup => self.p_sup_pa.as_deref(),
            Column::FExt => self.f_ext_n.as_deref(),
            Column::YRef => self.y_ref_m.as_deref(),
            Column::V => self.v_m_per_s.as_deref(),
            Column::Z => self.z_m.as_deref(),
        }
    }

    /// Sets or removes a column; the values must be as many as the times.
    pub fn set(&mut self, column: Column, values: Option<Vec<f64>>) {
        match column {
            Column::Y => self.y_m = values.unwrap_or_default(),
            Column::U => self.u_v = values,
            Column::PA => self.p_a_pa = values,
            Column::PB => self.p_b_pa = values,
            Column::PSup => self.p_sup_pa = values,
            Column::FExt => self.f_ext_n = values,
            Column::YRef => self.y_ref_m = values,
            Column::V => self.v_m_per_s = values,
            Column::Z => self.z_m = values,
        }
    }

    /// A column as it is if its readings were taken `later_s` after the times of their rows: that of the nearest row, because values
    /// in between would have less noise than the sensor. Blank where no row is within half the usual time between rows.
    #[must_use]
    pub fn shifted(&self, column: Column, later_s: f64) -> Option<Vec<f64>> {
        let values = self.column(column)?;
        // Rounding must not take two rows that are half of it away for farther ones.
        let reach_s = 0.5001 * self.period_s();
        let at = |t_s: f64| {
            let after = self.t_s.partition_point(|t| *t < t_s);
            let near = [after.checked_sub(1), Some(after)].into_iter().flatten().filter(|row| *row < self.len());
            let distance = |row: &usize| (self.t_s[*row] - t_s).abs();
            near.min_by(|one, other| distance(one).total_cmp(&distance(other))).filter(|row| distance(row) <= reach_s)
        };
        Some(self.t_s.iter().map(|t| at(t - later_s).map_or(f64::NAN, |row| values[row])).collect())
    }

    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.t_s.len()
    }

    /// No rows at all (a parsed log always has some).
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.t_s.is_empty()
    }

    /// The usual time between rows (the median), s; zero for a single row.
    #[must_use]
    pub fn period_s(&self) -> f64 {
        let mut steps: Vec<f64> = self.t_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if steps.is_empty() {
            return 0.0;
        }
        let middle = steps.len() / 2;
        *steps.select_nth_unstable_by(middle, f64::total_cmp).1
    }

    /// Where samples are missing: rows (time steps of more than 2.5 usual ones) and runs of blank fields.
    #[must_use]
    pub fn gaps(&self) -> Vec<Gap> {
        let limit_s = GAP_FACTOR * self.period_s();
        let mut gaps: Vec<Gap> = self
            .t_s
            .windows(2)
            .filter(|pair| pair[1] - pair[0] > limit_s)
            .map(|pair| Gap { column: None, from_s: pair[0], to_s: pair[1] })
            .collect();
        for column in Column::ALL {
            let Some(values) = self.column(column) else { continue };
            let mut start = None;
            for (row, value) in values.iter().enumerate() {
                match (value.is_nan(), start) {
                    (true, None) => start = Some(self.t_s[row.saturating_sub(1)]),
                    (false, Some(from_s)) => {
                        gaps.push(Gap { column: Some(column), from_s, to_s: self.t_s[row] });
                        start = None;
                    }
                    _ => {}
                }
            }
            if let (Some(from_s), Some(&to_s)) = (start, self.t_s.last()) {
                gaps.push(Gap { column: Some(column), from_s, to_s });
            }
        }
        gaps
    }

    /// Sentences about values that this rig cannot have produced: usually a wrong unit or a gauge pressure.
    #[must_use]
    pub fn suspicions(&self, rig: &RigFile) -> Vec<String> {
        let mut found = Vec::new();
        let (rig, io, atmosphere) = (&rig.rig, &rig.io, rig.rig.supply.atmosphere_pa);
        let half = rig.cylinder.stroke_m / 2.0;
        if let Some((low, high)) = extent(&self.y_m)
            && (low < -1.1 * half || high > 1.1 * half)
        {
            let [low, high] = [low, high].map(Short);
            found.push(format!(
                "y_m runs from {low:.4} to {high:.4} m but the stroke allows ±{half} m: is it in metres, from mid-stroke?"
            ));
        }
        for column in [Column::PA, Column::PB, Column::PSup] {
            let Some((low, high)) = self.column(column).and_then(extent) else { continue };
            let name = column.name();
            if high < 0.2 * atmosphere {
                found.push(format!(
                    "{name} never exceeds {:.4} Pa, far below atmosphere: is it in bar, MPa or kPa?",
                    Short(high)
                ));
            } else if low < 0.5 * atmosphere {
                let low = Short(low);
                found.push(format!("{name} falls to {low:.0} Pa, far below atmosphere: is it gauge pressure?"));
            } else if io.is_pressure_end(high) {
                let values = self.column(column).unwrap_or_default();
                let rows = values.iter().filter(|p| **p == high).count();
                found.push(format!(
                    "{name} reads {:.0} Pa, the end of its sensor's range, in {rows} of {} rows: they are not judged",
                    Short(high),
                    values.len()
                ));
            } else if high > 1.5 * rig.supply.pressure_pa {
                found.push(format!(
                    "{name} rises to {:.0} Pa, far above the supply of {} Pa: check its unit",
                    Short(high),
                    Short(rig.supply.pressure_pa)
                ));
            }
        }
        if let Some((low, high)) = self.column(Column::U).and_then(extent)
            && low.abs().max(high.abs()) > 1.2 * rig.valve.max_voltage_v
        {
            let [low, high] = [low, high].map(Short);
            found.push(format!(
                "u_v runs from {low:.3} to {high:.3} V but the valve takes ±{} V: is it about mid position?",
                rig.valve.max_voltage_v
            ));
        }
        found
    }

    /// The log as CSV; numbers are written so that they read back to the same bits, missing samples are blank.
    #[must_use]
    pub fn to_csv(&self) -> String {
        let columns: Vec<_> =
            Column::ALL.into_iter().filter_map(|column| Some((column.name(), self.column(column)?))).collect();
        let mut text = String::with_capacity(self.len() * (columns.len() + 1) * 12);
        text.push_str("t_s");
        for (name, _) in &columns {
            text.push(',');
            text.push_str(name);
        }
        text.push('\n');
        for (row, t_s) in self.t_s.iter().enumerate() {
            // Writing to a String cannot fail.
            let _ = write!(text, "{t_s}");
            for (_, values) in &columns {
                text.push(',');
                if let Some(value) = values.get(row).filter(|value| value.is_finite()) {
                    let _ = write!(text, "{value}");
                }
            }
            text.push('\n');
        }
        text
    }

    /// Writes the log, whole or not at all.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), InputError> {
        write_file(path, |out| out.write_all(self.to_csv().as_bytes()))
    }
}

/// Smallest and largest of the samples that are there.
fn extent(values: &[f64]) -> Option<(f64, f64)> {
    values.iter().copied().filter(|value| value.is_finite()).fold(None, |extent, value| match extent {
        None => Some((value, value)),
        Some((low, high)) => Some((low.min(value), high.max(value))),
    })
}
