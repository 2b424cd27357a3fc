//! Time stamps: a date with a time, or a time of day.

use chrono::format::{Item, StrftimeItems};
use chrono::{DateTime, NaiveDateTime};

/// Nanoseconds of a second.
pub(super) const SECOND_NS: i128 = 1_000_000_000;
/// Nanoseconds of a day.
pub(super) const DAY_NS: i128 = 86_400 * SECOND_NS;

/// A date with a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stamp {
    /// Since 1970; of universal time if `zoned`, of the clock on the wall if not.
    pub(super) ns: i128,
    /// The stamp says how far its clock is from universal time.
    pub(super) zoned: bool,
}

/// Dates that can be read in one way only.
const DATES: [&str; 6] = ["%Y-%m-%d", "%d.%m.%Y", "%Y/%m/%d", "%d-%b-%Y", "%d %b %Y", "%b %d %Y"];
/// How a format says that an offset from universal time stands there.
const OFFSETS: [&str; 5] = ["%z", "%:z", "%::z", "%:::z", "%#z"];
const TIMES: [&str; 3] = ["%H:%M:%S%.f", "%H:%M", "%I:%M:%S%.f %p"];

/// Reads stamps without a stated format; remembers which one fitted last.
#[derive(Clone, Debug, Default)]
pub(super) struct Reader {
    last: usize,
}

impl Reader {
    /// A stamp such as `2026-03-01T10:00:00.125+01:00`, `01.03.2026 10:00:00,125`.
    pub(super) fn read(&mut self, cell: &str) -> Option<Stamp> {
        let text = plain(cell);
        if !text.contains(':') {
            return None;
        }
        let (text, zone) = without_universal(&text);
        let count = DATES.len() * TIMES.len();
        let fits = |at: &usize| {
            let at = at % count;
            let (date, time) = (DATES[at % DATES.len()], TIMES[at / DATES.len()]);
            // `%Y` also takes years of two digits, which `%d.%m.%Y` would then share with other orders.
            (!date.starts_with("%Y") || text.bytes().take(4).filter(u8::is_ascii_digit).count() == 4)
                .then(|| parse(text, &format!("{date} {time}")))?
                .map(|stamp| (at, stamp))
        };
        let (at, stamp) = (self.last..self.last + count).find_map(|at| fits(&at))?;
        self.last = at;
        Some(Stamp { zoned: stamp.zoned || zone, ..stamp })
    }
}

/// A stamp in the format that the mapping states. A zone's name says nothing of its clock, unless it is that of universal time.
pub(super) fn formatted(cell: &str, format: &str) -> Option<Stamp> {
    let cell = plain(cell);
    let format = blank_for_t(format);
    let (text, universal) = without_universal(&cell);
    if !universal {
        return if format.contains("%Z") { None } else { parse(&cell, &format) };
    }
    let bare = OFFSETS.iter().chain(&["%Z"]).fold(format.clone(), |format, zone| format.replace(zone, ""));
    // The mark may stand in the format as it stands in the cell.
    let stamp = parse(text, bare.trim_end()).or_else(|| parse(&cell, &format))?;
    Some(Stamp { zoned: true, ..stamp })
}

/// A format with a blank between date and time, as [`plain`] writes stamps.
fn blank_for_t(format: &str) -> String {
    let mut out = format.to_string();
    // Behind a letter of the format, such as `%d`, and not a letter of it, such as `%T`.
    if let Some(at) = format.find("T%")
        && at >= 2
        && format.as_bytes()[at - 2] == b'%'
    {
        out.replace_range(at..=at, " ");
    }
    out
}

fn parse(text: &str, format: &str) -> Option<Stamp> {
    let since_1970 = |s: i64, ns: u32| i128::from(s) * SECOND_NS + i128::from(ns);
    // Without a zone of its own a stamp would pass over the offset that the format reads.
    let has_offset = OFFSETS.iter().any(|offset| format.contains(offset));
    if !has_offset && let Ok(stamp) = NaiveDateTime::parse_from_str(text, format) {
        let utc = stamp.and_utc();
        return Some(Stamp { ns: since_1970(utc.timestamp(), utc.timestamp_subsec_nanos()), zoned: false });
    }
    let zoned = if has_offset { format.into() } else { format!("{format}%#z") };
    let stamp = DateTime::parse_from_str(text, &zoned).ok()?;
    Some(Stamp { ns: since_1970(stamp.timestamp(), stamp.timestamp_subsec_nanos()), zoned: true })
}

/// The cell with a blank between date and time and a point before fractions of a second.
fn plain(cell: &str) -> String {
    let mut text = cell.trim().to_string();
    if let Some(at) = text.find('T')
        && text[..at].ends_with(|c: char| c.is_ascii_digit())
        && text[at + 1..].starts_with(|c: char| c.is_ascii_digit())
    {
        text.replace_range(at..=at, " ");
    }
    // `10:00:00,125` and `10:00:00:125`.
    if let Some(clock) = text.find(':')
        && let Some(seconds) = text[clock + 1..].find(':').map(|at| clock + 1 + at)
        && let Some(fraction) = text[seconds + 1..].find([',', ':', '.']).map(|at| seconds + 1 + at)
        && text[seconds + 1..fraction].bytes().all(|byte| byte.is_ascii_digit())
    {
        text.replace_range(fraction..=fraction, ".");
    }
    // `10:00:00 +01:00`: the offset belongs to the time.
    text.replace(" +", "+").split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Without the mark of universal time, and whether there was one.
fn without_universal(text: &str) -> (&str, bool) {
    let word = text.rfind(|c: char| !c.is_ascii_alphabetic()).map_or(0, |at| at + 1);
    // What stands before the mark may end in a sign of more than one byte.
    match text.get(word..) {
        Some(mark) if is_universal(mark) => (text[..word].trim_end(), true),
        _ => (text, false),
    }
}

fn is_universal(zone: &str) -> bool {
    ["Z", "UTC", "GMT"].iter().any(|mark| zone.eq_ignore_ascii_case(mark))
}

/// A time without the name of the zone behind it, and that name, such as `CET` or `Europe/Berlin`. `None` for a time without
/// such a name, for universal time, and for what is no time.
pub(super) fn zone_by_name(cell: &str) -> Option<(&str, &str)> {
    let cell = cell.trim();
    let clock = cell.rfind(':')?;
    let mut at = clock + cell[clock..].find(char::is_alphabetic)?;
    let half = cell.get(at..at + 2).filter(|word| ["AM", "PM"].iter().any(|half| half.eq_ignore_ascii_case(word)));
    if half.is_some() {
        at += 2;
    }
    let name = cell[at..].trim_matches([' ', '[', ']', '(', ')']);
    let time = cell[..at].trim_end_matches([' ', '[', '(']);
    let reads = Reader::default().read(time).is_some() || formats(time).is_some() || time_of_day(time).is_some();
    (name.starts_with(char::is_alphabetic) && !is_universal(name) && reads).then_some((time, name))
}

/// Nanoseconds since midnight of `10:00:00.125`, `10:00:00,125`, `9:59:59 PM`; hours above 24 of an elapsed time are taken, too.
pub(super) fn time_of_day(cell: &str) -> Option<i128> {
    let text = plain(cell);
    let upper = without_universal(&text).0.to_ascii_uppercase();
    let (clock, half) = match (upper.strip_suffix("AM"), upper.strip_suffix("PM")) {
        (Some(rest), _) => (rest.trim_end(), Some(0)),
        (_, Some(rest)) => (rest.trim_end(), Some(12)),
        _ => (upper.as_str(), None),
    };
    let mut parts = clock.split(':');
    let (hours, minutes, seconds) = (parts.next()?, parts.next()?, parts.next()?);
    let digits = |text: &str, most: usize| -> Option<i128> {
        let whole = (1..=most).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_digit());
        whole.then(|| text.parse().ok())?
    };
    let (seconds, fraction) = seconds.split_once('.').unwrap_or((seconds, "0"));
    let ns: String = fraction.chars().chain("000000000".chars()).take(9).collect();
    let (mut h, m, s, ns) = (digits(hours, 5)?, digits(minutes, 2)?, digits(seconds, 2)?, digits(&ns, 9)?);
    if let Some(half) = half {
        h = (1..=12).contains(&h).then(|| h % 12 + half)?;
    }
    let good = parts.next().is_none() && m < 60 && s <= 60 && fraction.bytes().all(|byte| byte.is_ascii_digit());
    good.then_some(((h * 60 + m) * 60 + s) * SECOND_NS + ns)
}

/// The numbers of a date that could be read in two ways, `03/04/2026` or `03-04-26`, with what separates them.
pub(super) fn two_ways(cell: &str) -> Option<(u32, u32, char)> {
    let date = cell.trim().split([' ', 'T']).next()?;
    let mark = if date.contains('/') { '/' } else { '-' };
    let parts: Vec<&str> = date.split(mark).collect();
    let [first, second, year] = parts[..] else { return None };
    let number = |text: &str, lengths: &[usize]| -> Option<u32> {
        lengths.contains(&text.len()).then(|| text.parse().ok())?.filter(|_| text.bytes().all(|b| b.is_ascii_digit()))
    };
    number(year, &[2, 4])?;
    let (first, second) = (number(first, &[1, 2])?, number(second, &[1, 2])?);
    ((1..=31).contains(&first) && (1..=31).contains(&second)).then_some((first, second, mark))
}

/// The format of a stamp whose date can be read in two ways; `None` for the order that the cell rules out.
pub(super) fn formats(cell: &str) -> Option<[Option<String>; 2]> {
    let (first, second, mark) = two_ways(cell)?;
    let date = cell.trim().split([' ', 'T']).next()?;
    let year = if date.rsplit(mark).next()?.len() == 2 { "%y" } else { "%Y" };
    let upper = cell.to_ascii_uppercase();
    let time = match (upper.ends_with("AM") || upper.ends_with("PM"), cell.matches(':').count()) {
        (true, _) => "%I:%M:%S%.f %p",
        (false, 1) => "%H:%M",
        _ => "%H:%M:%S%.f",
    };
    let format = |a: &str, b: &str| format!("{a}{mark}{b}{mark}{year} {time}");
    Some([(second <= 12).then(|| format("%d", "%m")), (first <= 12).then(|| format("%m", "%d"))])
}

/// Whether a format can be understood at all.
pub(super) fn is_format(format: &str) -> bool {
    format.contains('%') && !StrftimeItems::new(format).any(|item| matches!(item, Item::Error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_moment_is_read_from_every_way_of_writing_it() {
        let moment = Stamp { ns: 1_772_359_200_125_000_000, zoned: false };
        for cell in [
            "2026-03-01 10:00:00.125",
            "2026-03-01T10:00:00,125",
            "2026/03/01 10:00:00.125000",
            "01.03.2026 10:00:00,125",
            "1.3.2026 10:00:00.125",
            "01.03.2026  10:00:00:125",
            "01-Mar-2026 10:00:00.125",
            "2026-03-01 10:00:00.125 AM",
        ] {
            assert_eq!(Reader::default().read(cell), Some(moment), "{cell}");
        }
        for cell in [
            "2026-03-01T10:00:00.125Z",
            "2026-03-01 11:00:00.125+01:00",
            "2026-03-01 11:00:00.125 +0100",
            "2026-03-01T05:00:00,125-05:00",
            "2026-03-01 10:00:00.125 UTC",
            "2026-03-01 10:00:00.125UTC",
            "2026-03-01 10:00:00.125 utc",
            "01.03.2026 10:00:00,125 GMT",
            "2026-03-01 10:00:00.125 AM Z",
        ] {
            assert_eq!(Reader::default().read(cell), Some(Stamp { zoned: true, ..moment }), "{cell}");
        }
        for cell in ["03/01/2026 10:00:00", "10:00:00", "2026-03-01", "2026-13-01 10:00:00", "x", "", "T", "1:"] {
            assert_eq!(Reader::default().read(cell), None, "{cell}");
        }
    }

    #[test]
    fn a_zone_is_known_by_its_offset_or_as_universal_time_and_never_by_another_name() {
        let moment = Stamp { ns: 1_772_359_200_125_000_000, zoned: true };
        for (cell, format) in [
            ("2026-03-01 10:00:00.125 UTC", "%Y-%m-%d %H:%M:%S%.f"),
            ("2026-03-01 10:00:00.125 UTC", "%Y-%m-%d %H:%M:%S%.f UTC"),
            ("2026-03-01 10:00:00.125 GMT", "%Y-%m-%d %H:%M:%S%.f %Z"),
            ("2026-03-01T10:00:00.125Z", "%Y-%m-%dT%H:%M:%S%.f%z"),
            ("2026-03-01T11:00:00.125+0100", "%Y-%m-%dT%T%.f%z"),
        ] {
            assert_eq!(formatted(cell, format), Some(moment), "{cell} by {format}");
        }
        // A name that the format has in every row is no more than text.
        let by_text = formatted("2026-03-01 10:00:00.125 CET", "%Y-%m-%d %H:%M:%S%.f CET");
        assert_eq!(by_text, Some(Stamp { zoned: false, ..moment }));
        assert_eq!(formatted("2026-03-01 10:00:00.125 CEST", "%Y-%m-%d %H:%M:%S%.f CET"), None);
        assert_eq!(formatted("2026-03-01 10:00:00.125 CET", "%Y-%m-%d %H:%M:%S%.f %Z"), None);
        for (cell, name) in [
            ("2026-03-01 10:00:00.125 CET", "CET"),
            ("01.03.2026 10:00:00,125 MESZ", "MESZ"),
            ("03/01/2026 10:00:00 PM EST", "EST"),
            ("10:00:00 CEST", "CEST"),
            ("2026-03-01 10:00:00 GMT+1", "GMT+1"),
            ("2026-03-01T11:00:00+01:00[Europe/Berlin]", "Europe/Berlin"),
        ] {
            assert_eq!(Reader::default().read(cell), None, "{cell}");
            assert_eq!(zone_by_name(cell).map(|(_, name)| name), Some(name), "{cell}");
        }
        for cell in
            ["2026-03-01 10:00:00", "10:00:00 PM", "10:00:00 UTC", "2026-03-01 10:00:00Z", "x: CET", "10:00:00 €"]
        {
            assert_eq!(zone_by_name(cell), None, "{cell}");
        }
    }

    #[test]
    fn a_date_that_can_be_read_in_two_ways_asks_for_its_format() {
        let cell = "03/04/2026 10:00:00.5";
        let [day, month] = formats(cell).expect("two ways");
        let (day, month) = (day.expect("possible"), month.expect("possible"));
        let ns = |format: &str| formatted(cell, format).expect("fits").ns;
        // 3 April, and 4 March.
        assert_eq!(ns(&day) - ns(&month), 30 * DAY_NS);
        assert_eq!(
            formats("13/04/2026 10:00:00").map(|[day, month]| (day.is_some(), month.is_some())),
            Some((true, false))
        );
        assert!(is_format("%d/%m/%Y %H:%M:%S%.f") && !is_format("dd/mm/yyyy") && !is_format("%Q"));
    }

    #[test]
    fn a_time_of_day_is_read_with_its_fraction_and_half() {
        let ms = |cell: &str| time_of_day(cell).map(|ns| ns / 1_000_000);
        assert_eq!(ms("10:00:00.125"), Some(36_000_125));
        assert_eq!(ms("10:00:00,125"), Some(36_000_125));
        assert_eq!(ms("10:00:00:125"), Some(36_000_125));
        assert_eq!(ms("11:59:59 PM"), Some(86_399_000));
        assert_eq!(ms("12:00:00 AM"), Some(0));
        assert_eq!(ms("25:00:01"), Some(90_001_000));
        assert_eq!(ms("10:00:00.125 UTC"), Some(36_000_125));
        for cell in ["10:00", "10:61:00", "a:b:c", "1:2:3:4:5", "", "::", "13:00:00 PM"] {
            assert_eq!(ms(cell), None, "{cell}");
        }
    }
}
