"""Files of measured channels: what is written is read back, and what cannot be right is refused by its place."""

from pathlib import Path

import numpy as np
import pytest
import synthetic_drop as drop
from typer.testing import CliRunner

import softbrake
from softbrake.case.units import STANDARD_GRAVITY
from softbrake.cli.app import app
from softbrake.signals import Channel, SignalError, read_channels

TABLE = np.array([[0.0, 1.5, -2.0], [0.1, 2.5e-3, 3.0], [0.25, -4.0, 1e6]])


def text(folder: Path, content: str | bytes, name: str = "test.csv") -> Path:
    """A file of a text."""
    file = folder / name
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return file


def fault_of(folder: Path, content: str | bytes, **options: object) -> str:
    """What is said of a text, without the name of the file."""
    file = text(folder, content)
    with pytest.raises(SignalError) as caught:
        read_channels(file, **options)  # type: ignore[arg-type]
    assert str(caught.value).startswith(f"{file}:")
    return str(caught.value).removeprefix(f"{file}:").strip()


def rows(delimiter: str, comma: bool = False, ending: str = "\n") -> str:
    lines = ending.join(delimiter.join(repr(value) for value in row) for row in TABLE.tolist())
    return (lines.replace(".", ",") if comma else lines) + ending


def check(channels: list[Channel], table: np.ndarray = TABLE) -> None:
    """Acceleration in g and pressure in kPa over seconds."""
    assert [(each.name, each.unit, each.quantity) for each in channels] == [
        ("acc z", "g", "deceleration"),
        ("p", "kPa", "pressure"),
    ]
    for each, values, size in zip(channels, table.T[1:], (STANDARD_GRAVITY, 1e3), strict=True):
        np.testing.assert_array_equal(each.time, table[:, 0])
        np.testing.assert_array_equal(each.values, values * size)


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "  "])
@pytest.mark.parametrize("comma", [False, True])
def test_delimiters_and_decimal_marks(tmp_path: Path, delimiter: str, comma: bool) -> None:
    header = delimiter.join(("time [s]", "acc z [g]", "p [kPa]")) + "\n"
    if delimiter == "," and comma:
        assert fault_of(tmp_path, header + rows(delimiter, comma)).startswith("1:1: 3 names above rows of 6 cells; ")
    else:
        check(read_channels(text(tmp_path, header + rows(delimiter, comma))))


@pytest.mark.parametrize(
    "header",
    [
        "time [s];acc z [g];p [kPa]",
        "time (s);acc z (g);p (kPa)",
        "time / s;acc z / g;p / kPa",
        '"time [s]";"acc z [g]";"p [kPa]"',
        "# time [s];acc z [g];p [kPa]",
        "Test 42;hall 2\nrate: 10 kHz\n\n% filtered\ntime [s];acc z [g];p [kPa]",
        "Test;42;7\ntime;acc z;p\ns;g;kPa",
        "time;acc z;p\n[s];[g];[kPa]",
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize("ending", ["\n", "\r\n"])
def test_headers(tmp_path: Path, header: str, encoding: str, ending: str) -> None:
    content = (header + "\n").replace("\n", ending) + rows(";", ending=ending)
    check(read_channels(text(tmp_path, content.encode(encoding))))


def test_names_apart_by_single_spaces_keep_their_units(tmp_path: Path) -> None:
    check(read_channels(text(tmp_path, 'time [s] "acc z" (g) p [kPa]\n' + rows(" "))), TABLE)


def test_comments_blank_lines_quotes_and_a_delimiter_at_the_end_of_lines(tmp_path: Path) -> None:
    lines = [f'"{row}";'.replace(";", '";"', 2) for row in rows(";").splitlines()]
    lines[1:1] = ["", "# in between", "  // too"]
    check(read_channels(text(tmp_path, "time [s];acc z [g];p [kPa];\n" + "\n".join(lines))))


@pytest.mark.parametrize(
    ("unit", "size"),
    [
        ("m/s^2", 1.0),
        ("m/s2", 1.0),
        ("m/s²", 1.0),
        ("m/s**2", 1.0),
        ("m/(s*s)", 1.0),
        ("mm/s^2", 1e-3),
        ("g_n", STANDARD_GRAVITY),
    ],
)
def test_spellings_of_an_acceleration(tmp_path: Path, unit: str, size: float) -> None:
    (channel,) = read_channels(text(tmp_path, f"t [ms];a [{unit}]\n0;1\n0.5;2\n"))
    assert (channel.quantity, channel.unit) == ("deceleration", unit)
    np.testing.assert_allclose(channel.values, [size, 2.0 * size], rtol=1e-15)
    np.testing.assert_allclose(channel.time, [0.0, 0.5e-3], rtol=1e-15)


def test_units_and_the_column_of_times_can_be_given(tmp_path: Path) -> None:
    file = text(tmp_path, "n,t,a [mV],left (front)\n1,0,1,2\n2,10,3,4\n")
    channels = read_channels(file, units={"t": "us", "a": "g"}, time="t")
    assert [(each.name, each.unit, each.quantity) for each in channels] == [
        ("n", "", None),
        ("a", "g", "deceleration"),
        ("left (front)", "", None),
    ]
    np.testing.assert_allclose(channels[1].time, [0.0, 1e-5], rtol=1e-15)
    assert channels[1].values.tolist() == [STANDARD_GRAVITY, 3.0 * STANDARD_GRAVITY]


def test_units_that_are_not_known_leave_values_as_they_are(tmp_path: Path) -> None:
    channels = read_channels(text(tmp_path, "t [s];T [°C];F [kN];U [mV]\n0;20;1;2\n1;21;3;4\n".encode("latin-1")))
    assert [(each.unit, each.quantity, each.values.tolist()) for each in channels] == [
        ("°C", None, [20.0, 21.0]),
        ("kN", None, [1e3, 3e3]),
        ("mV", None, [2.0, 4.0]),
    ]


HEAD = "t [s];a\n0,0;1\n"
CELL = "a number in each cell is expected"


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (HEAD + "0,1;\n", f"3:5: 'a': no value; {CELL}"),
        (HEAD + "0,1;NaN\n", f"3:5: 'a': no value, 'NaN'; {CELL}"),
        ("t [s];a\n0,0;\n0,1;1\n", f"2:5: 'a': no value; {CELL}"),
        (HEAD + "0,1;inf\n", f"3:5: 'a': no value, 'inf'; {CELL}"),
        (HEAD + "0,1;1e999\n", "3:5: 'a': 1e999 is not finite; a finite number is expected"),
        (HEAD + "0,1;1_0\n", "3:5: 'a': '1_0' is no number; one as 1.5e-3 is expected"),
        (
            HEAD + "0,1;2.5\n",
            "3:5: 'a': '2.5' has a point, others have commas; one decimal mark and none of thousands is expected",
        ),
        (HEAD + "0,1\n", "3:1: a row of 1, 2 in the header; a number below each name is expected"),
        (HEAD + "0,1;1;2\n", "3:1: a row of 3, 2 in the header; a number below each name is expected"),
        (HEAD + "0,0;2\n", "3:1: time 0,0 is not after 0,0 of the row before; times that rise are expected"),
        (HEAD + "-1;2\n", "3:1: time -1 is not after 0,0 of the row before; times that rise are expected"),
        (HEAD, "2:1: one row of numbers; two at least are expected"),
        (
            "t [s];a\n0;1,234\n1;2\n2;12,345\n",
            "2:4: each comma may mark decimals or thousands; "
            "numbers without a mark of thousands, or one comma with other than three digits behind it, are expected",
        ),
        ("t;a\n0;1\n1;2\n", "1:1: times 't': no unit; 't [s]', 't [ms]' or a unit given for it is expected"),
        ("t [m];a\n0;1\n1;2\n", "1:1: times 't': 'm' is a length; 't [s]', 't [ms]' or a unit given for it is expected"),
        ("t [s];a;a [g]\n0;1;2\n1;2;3\n", "1:9: a second column 'a'; names that differ are expected"),
        (",a\n0,1\n1,2\n", "1:1: column 1 has no name; a name for each column is expected"),
        ("0,1\n1,2\n", "1:1: no header; a line with a name for each column is expected, as 'time [s]', above the numbers"),
        (
            "t [s]\n12:30;1\n",
            "no row of numbers; below a header a time and a value at least in each line are expected, "
            "apart by tabs, semicolons, commas or spaces",
        ),
        (b"t [s];a\0\n", "is no text; columns of numbers, or a file *.mme, *.uff, *.tdms are expected"),
    ],
)
def test_faults_of_a_text(tmp_path: Path, content: str | bytes, fault: str) -> None:
    assert fault_of(tmp_path, content) == fault


def test_a_few_commas_that_are_no_marks_of_thousands_settle_all(tmp_path: Path) -> None:
    (channel,) = read_channels(text(tmp_path, "t [s];a\n0,001;1,234\n1,002;12,345\n"))
    assert channel.values.tolist() == [1.234, 12.345]


def test_faults_of_what_is_asked_for(tmp_path: Path) -> None:
    content = "t [s];a\n0;1\n1;2\n"
    assert fault_of(tmp_path, content, time="b") == "no column 'b' for the times; 't', 'a' are expected"
    assert fault_of(tmp_path, content, units={"b": "g"}) == "no channel 'b' to give a unit; 't', 'a' are expected"
    told = "channel 'a': 'gg' is no unit; one as 'g', 'm/s^2' or 'kPa' is expected"
    assert fault_of(tmp_path, content, units={"a": "gg"}) == told
    with pytest.raises(SignalError, match="none.csv: cannot be read: No such file or directory"):
        read_channels(tmp_path / "none.csv")


def test_random_tables_of_any_form_are_read_to_the_last_digit(tmp_path: Path) -> None:
    random = np.random.default_rng(20)
    for _ in range(40):
        count, columns = random.integers(2, 40), random.integers(2, 6)
        values = random.normal(size=(count, columns)) * 10.0 ** random.integers(-12, 12, (count, columns))
        values[:, 0] = np.sort(random.normal(size=count))
        delimiter = random.choice([",", ";", "\t", " "])
        comma, quoted = delimiter != "," and random.random() < 0.5, random.random() < 0.3
        lines = [f"c{k} [s]" if k == 0 else f"c{k}" for k in range(columns)], *[list(map(repr, row)) for row in values.tolist()]
        body = "\n".join(delimiter.join(f'"{cell}"' if quoted else cell for cell in line) for line in lines)
        channels = read_channels(text(tmp_path, body.replace(".", ",") if comma else body))
        np.testing.assert_array_equal(channels[0].time, values[:, 0])
        np.testing.assert_array_equal(np.transpose([each.values for each in channels]), values[:, 1:])


def test_exported_curves_are_read_back_exactly(tmp_path: Path) -> None:
    drop.write(tmp_path / "drop.vtkhdf", drop.case(4, 8))
    assert CliRunner().invoke(app, ["export", str(tmp_path / "drop.vtkhdf"), "--csv"]).exit_code == 0
    result = softbrake.read_result(tmp_path / "drop.vtkhdf")
    channels = read_channels(tmp_path / "drop.csv")
    assert {each.name: each.unit for each in channels} | {"time": "s"} == result.units
    for each in channels:
        np.testing.assert_array_equal(each.time, result.history["time"])
        np.testing.assert_array_equal(each.values, result.history[each.name])
