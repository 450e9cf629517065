//! `grazemap loci` as users run it.

use super::{grazemap, scratch, text};

#[test]
fn the_table_of_loci_has_the_columns_promised_and_labels_the_point() {
    let folder = scratch();
    let call = ["loci", "linear_codim2", "--in", "omega,alpha", "--itinerary", "1", "-q"];
    let range = ["--from", "-1e-4", "--to", "1e-4", "--kind", "fold,graze", "--csv", "-"];
    let output = grazemap(folder.path(), &[&call[..], &range].concat());
    assert_eq!(output.status.code(), Some(0));
    let table = text(&output.stdout);
    let mut lines = table.lines();
    let header = "locus,kind,itinerary,omega,omega_value,alpha,alpha_value,stable,physical,inside,\
                  label";
    assert_eq!(lines.next(), Some(header));
    let labelled: Vec<(&str, &str)> = lines
        .filter_map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            (!cells[10].is_empty()).then_some((cells[1], cells[10]))
        })
        .collect();
    assert_eq!(labelled, [("graze", "xi_1"), ("fold", "SN-GR")]);
}
