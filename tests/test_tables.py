"""Tables: one source, as a terminal shows them, as CSV, and as LaTeX."""

import csv

from studies.tables import NEVER, Table, noted_tables, write_tables
from studies.text import clock, columns

HEAD = ("line", "asked & found", "share")
ROWS = [("rise_time", "a, b", "5 %"), ("x^2", "$1 < 2", "12 %")]


def test_a_table_of_a_text_is_written_as_csv_that_says_the_same(tmp_path):
    with noted_tables() as noted:
        columns(("left", "out"), [("1", "2")])
        text = "before\n\n" + columns(HEAD, ROWS) + "\nbehind it\n\n" + columns(("a",), [("b",)])
    names = write_tables(text, noted, tmp_path)

    assert names == ["table_1", "table_2"]
    with (tmp_path / "table_1.csv").open(newline="") as file:
        assert [*map(tuple, csv.reader(file))] == [HEAD, *ROWS]
    assert (tmp_path / "table_2.csv").read_text() == "a\nb\n"


def test_latex_has_a_column_each_and_no_letter_that_it_would_take_for_a_command():
    lines = Table(HEAD, tuple(ROWS)).latex.splitlines()

    assert lines[1:5] == [
        r"\begin{tabular}{llr}",
        r"\toprule",
        r"line & asked \& found & share \\",
        r"\midrule",
    ]
    assert lines[5] == r"rise\_time & a, b & 5 \% \\"
    assert lines[6] == r"x\textasciicircum{}2 & \$1 \textless{} 2 & 12 \% \\"
    assert lines[7:] == [r"\bottomrule", r"\end{tabular}"]


def test_of_a_former_run_no_table_stays_beside_fewer_new_ones(tmp_path):
    """As of two recordings, and then of one: the second's would be taken for this one's."""
    with noted_tables() as noted:
        texts = [columns(HEAD, ROWS), columns(("one", "two"), [("3", "4")])]
    write_tables("\n\n".join(texts), noted, tmp_path)
    (tmp_path / "table_4.csv").write_text("of somebody else\n")
    write_tables(texts[1], noted, tmp_path)

    left = sorted(path.name for path in tmp_path.iterdir())
    assert left == ["table_1.csv", "table_1.tex", "table_4.csv"]
    assert (tmp_path / "table_1.csv").read_text() == "one,two\n3,4\n"


def test_nothing_is_noted_outside_and_the_innermost_gets_it():
    columns(HEAD, ROWS)
    with noted_tables() as outer, noted_tables() as inner:
        columns(HEAD, ROWS)

    assert (len(outer), len(inner)) == (0, 1)


def test_names_that_begin_with_a_digit_are_words_and_never_is_a_number():
    text = columns(
        ("mode", "settle ms", "place", "of"),
        [
            ("1 slide + 1 low", "145", "5.1 mm", "9 of 10"),
            ("12 stick", NEVER, "-0.5 mm", "10 of 10"),
        ],
    )

    assert text.splitlines() == [
        "mode             settle ms    place        of",
        "1 slide + 1 low        145   5.1 mm   9 of 10",
        "12 stick             never  -0.5 mm  10 of 10",
    ]


def test_wall_times_are_in_the_unit_that_needs_no_exponent():
    assert clock([65e-6, 160e-6]) == ("us", 1e6)
    assert clock([65e-6, 38.43e-3]) == ("ms", 1e3)
    assert clock([]) == ("us", 1e6)
