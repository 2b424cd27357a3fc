//! All checks on a board, one after the other. Skipped with a message without one.

use board_tests::table::{OnTheTable, port_name};
use board_tests::{CHECKS, Outcome};
use test_stages::skipped;

#[test]
fn a_board_on_the_table_passes_all_checks() {
    let name = match port_name() {
        Ok(name) => name,
        Err(why) => return skipped("the board on the table", &why),
    };
    let mut bench = OnTheTable::open(&name).unwrap_or_else(|error| panic!("{error}"));
    let mut failed = Vec::new();
    for check in CHECKS {
        match check.run(&mut bench) {
            Ok(Outcome::Passed(numbers)) => println!("{check:?}: {numbers}"),
            Ok(Outcome::Skipped(why)) => skipped(&format!("{check:?}"), &why),
            Err(failure) => {
                println!("{check:?} FAILED: {failure}");
                failed.push(format!("{check:?}: {failure}"));
            }
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}
