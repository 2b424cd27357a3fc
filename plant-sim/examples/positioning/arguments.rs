//! What the command line asks for.

/// What can be given: the study, then constants of the law, most as a factor.
const NAMES: &str = "seeds draws draws_mm first noise friction stiff valve_ms pressures_ms bs hz lost moves loads ends obstacles streams sines sine_hz sent_ms sent_um sent_noise_um list trace seed drawn ticks every \
                     w wo J A V fr blend sg sf sv st he hl hs hf hb hm jt fc0 ul lg lz lf sr sm sn";

/// Cases, `tick`, and numbers by name.
pub(crate) struct Arguments(Vec<String>);

impl Arguments {
    /// Says what is not known, and ends the program then.
    pub(crate) fn of_the_command_line() -> Self {
        let arguments: Vec<String> = std::env::args().skip(1).collect();
        for argument in &arguments {
            let known = match argument.split_once('=') {
                Some((name, number)) => {
                    NAMES.split_whitespace().any(|known| known == name) && number.parse::<f64>().is_ok()
                }
                None => argument == "tick" || argument.chars().all(|case| "abc".contains(case)),
            };
            if !known {
                eprintln!("`{argument}` is not known; there are cases (`abc`), `tick`, and `NAME=NUMBER` of: {NAMES}");
                std::process::exit(2);
            }
        }
        Self(arguments)
    }

    /// The number that was given by this name.
    pub(crate) fn value(&self, name: &str) -> Option<f64> {
        self.0.iter().find_map(|a| a.strip_prefix(name)?.strip_prefix('=')?.parse::<f64>().ok())
    }

    /// The number that was given by this name, or the other.
    pub(crate) fn or(&self, name: &str, otherwise: f64) -> f64 {
        self.value(name).unwrap_or(otherwise)
    }

    /// Whether the firmware's tick drives the valve.
    pub(crate) fn in_tick(&self) -> bool {
        self.0.iter().any(|a| a == "tick")
    }

    /// The letters of the cases.
    pub(crate) fn cases(&self) -> &str {
        self.0.iter().find(|a| !a.contains('=') && *a != "tick").map_or("abc", String::as_str)
    }
}
