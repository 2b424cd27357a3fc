//! What the positioning law has learned, as people read it.

use crate::gap::significant;
use board_link::LearnedValues;
use control::{Quantities, Quantity};
use report_html::Table;

/// A value beside its nominal one and its limits, one line for each quantity.
#[must_use]
pub fn table(values: &LearnedValues) -> Table {
    let mut table = Table::new(["learned", "now", "nominal", "never below", "never above", "kept"]);
    for quantity in Quantity::ALL {
        let index = usize::from(quantity.number());
        let nominal = f64::from(values.nominal[index]);
        let [least, most] = quantity
            .limits()
            .map_or_else(|| ["–".to_owned(), "–".to_owned()], |limits| limits.map(|part| shown(part * nominal)));
        let kept = values.kept.map_or_else(|| "–".to_owned(), |kept| shown(kept[index].into()));
        let now = shown(values.now[index].into());
        table.row([quantity.name().to_owned(), now, shown(nominal), least, most, kept]);
    }
    table
}

/// Several runs, a line each, in parts of the nominal values; the limits first.
#[must_use]
pub fn comparison<'r>(runs: impl IntoIterator<Item = (&'r str, &'r LearnedValues)>) -> Table {
    let names = Quantity::ALL.iter().map(|quantity| match quantity {
        Quantity::FlowRight => "flow right",
        Quantity::FlowLeft => "left",
        Quantity::ZoneRight => "dead zone right",
        Quantity::ZoneLeft => "left",
        Quantity::Lag => "lag",
        Quantity::Coulomb => "Coulomb friction",
        Quantity::Viscous => "viscous",
        Quantity::Mass => "mass",
        Quantity::Load => "load, m/s²",
        Quantity::Bandwidth => "bandwidth",
    });
    let mut table = Table::new(std::iter::once("learned, over nominal").chain(names));
    let limits = Quantity::ALL
        .map(|quantity| quantity.limits().map_or_else(|| "–".to_owned(), |[least, most]| format!("{least} … {most}")));
    table.row(std::iter::once("between".to_owned()).chain(limits));
    for (name, values) in runs {
        let parts = Quantity::ALL.into_iter().zip(values.now).zip(values.nominal).map(|((quantity, now), nominal)| {
            match (quantity.limits(), nominal) {
                (None, _) => format!("{now:.3}"),
                // The rig has none of it, and none is learned.
                (Some(_), 0.0) => "–".to_owned(),
                (Some(_), _) => format!("{:.3}", now / nominal),
            }
        });
        table.row(std::iter::once(name.to_owned()).chain(parts));
    }
    table
}

fn shown(value: f64) -> String {
    significant(value, 4)
}

/// Names and values on one line, as the board's telemetry tells them.
#[must_use]
pub fn words(values: &Quantities) -> String {
    let word = |(quantity, value): (Quantity, &f32)| format!("{}={value}", quantity.name());
    Quantity::ALL.into_iter().zip(values).map(word).collect::<Vec<_>>().join(" ")
}
