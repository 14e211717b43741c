# SPDX-License-Identifier: Apache-2.0
"""Tables as programs write them: separators, decimal commas, lines above and below the header, names of columns."""

from pathlib import Path

import numpy as np
import pytest
from conftest import HALF, psi

from fluxtrue_tools.errors import FluxtrueError
from fluxtrue_tools.motor.map_import.table import read_map

D, Q = HALF
PSI = psi(D, Q)
ROWS = list(zip(D, Q, *PSI, strict=True))


def text(header: str, separator: str = ",", comma: bool = False, above: str = "", below: str = "") -> str:
    lines = [separator.join(f"{value:.9g}" for value in row) for row in ROWS]
    if comma:
        lines = [line.replace(".", ",") for line in lines]
    return "".join((above, header.replace(",", separator), "\n", below, "\n".join(lines), "\n"))


USUAL = "id_A,iq_A,psi_d_Vs,psi_q_Vs"


@pytest.mark.parametrize(
    "content",
    [
        text(USUAL),
        text(USUAL, ";"),
        text(USUAL, ";", comma=True),
        text(USUAL, "\t", comma=True),
        text("Id (A),Iq,Psi_d,Psi-q", below="A,A,Vs,Vs\n").replace("Id (A)", "I_d"),
        text("# " + USUAL, above="# written by a test bench\n"),
        "\ufeff" + text(USUAL),
        text(USUAL, ";", comma=True, above="Machine;A;200 kW\nDate;1.1.2026\n\n", below="A;A;Wb;Wb\n"),
    ],
    ids=["commas", "semicolons", "decimal commas", "tabs", "units", "comment", "mark", "preamble"],
)
def test_a_table_is_read_in_any_usual_form(tmp_path: Path, content: str) -> None:
    (tmp_path / "map.csv").write_text(content, encoding="utf-8")
    found = read_map(tmp_path / "map.csv", ()).quantities
    for name, wanted in zip(("i_d", "i_q", "psi_d", "psi_q"), (D, Q, *PSI), strict=True):
        assert found[name] == pytest.approx(wanted, rel=1e-8, abs=1e-12)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252"])
def test_a_table_is_read_in_the_encodings_of_windows(tmp_path: Path, encoding: str) -> None:
    """Names of columns have letters beyond ASCII. UTF-16 begins with its mark."""
    mark = "\ufeff" if encoding in ("utf-16-le", "utf-16-be") else ""
    content = mark + text("Strom d [A],Strom q [A],Flußverkettung d [V·s],Flußverkettung q [V·s]", ";", comma=True)
    (tmp_path / "map.csv").write_text(content, encoding=encoding)
    given = ("i_d=Strom d [A]", "i_q=Strom q [A]", "psi_d=Flußverkettung d [V·s]", "psi_q=Flußverkettung q [V·s]")
    found = read_map(tmp_path / "map.csv", given).quantities
    assert found["psi_q"] == pytest.approx(PSI[1], rel=1e-8, abs=1e-12)


@pytest.mark.parametrize("header", [
    "Id [A],Iq [A],Psi_d [mVs],Psi_q [mVs]", "i_d (A),i_q (A),psi_d (mWb),psi_q (mWb)", "Id / A,Iq / A,ψ,psi_q",
    "Id in A,Iq in A,Flux D / mV·s,Flux Q / mV·s",
])  # fmt: skip
def test_units_in_the_header_are_understood(tmp_path: Path, header: str) -> None:
    (tmp_path / "map.csv").write_text(text(header.replace("ψ", "Psi_d [ mVs ]"), ";", comma=True), encoding="utf-8")
    found = read_map(tmp_path / "map.csv", ())
    assert set(found.quantities) == {"i_d", "i_q", "psi_d", "psi_q"}
    assert found.stated == {"flux_unit": "mVs"}


def test_a_unit_in_a_chosen_header_counts_too(tmp_path: Path) -> None:
    (tmp_path / "map.csv").write_text(text("a,b,Fluss längs [mVs],Fluss quer [mVs]"), encoding="utf-8")
    given = ("i_d=a", "i_q=b", "psi_d=Fluss längs [mVs]", "psi_q=Fluss quer [mVs]")
    assert read_map(tmp_path / "map.csv", given).stated == {"flux_unit": "mVs"}


def test_a_unit_that_is_no_unit_of_the_quantity_does_not_make_it_known(tmp_path: Path) -> None:
    (tmp_path / "map.csv").write_text(text("Id [kA],Iq [kA],psi_d,psi_q"), encoding="utf-8")
    with pytest.raises(FluxtrueError, match="no header line"):
        read_map(tmp_path / "map.csv", ())


def test_two_units_of_flux_are_refused(tmp_path: Path) -> None:
    (tmp_path / "map.csv").write_text(text("Id [A],Iq [A],Psi_d [Vs],Psi_q [mVs]"), encoding="utf-8")
    with pytest.raises(FluxtrueError, match=r"columns in Vs and in mVs \('Psi_q \[mVs\]'\), allowed: one unit"):
        read_map(tmp_path / "map.csv", ())


def test_bytes_that_are_no_text_are_refused(tmp_path: Path) -> None:
    (tmp_path / "map.csv").write_bytes(b"\x81\x8d" + text(USUAL).encode())
    with pytest.raises(FluxtrueError, match="map.csv: not text in UTF-8, UTF-16 or Windows-1252"):
        read_map(tmp_path / "map.csv", ())


def test_columns_are_chosen_by_name(tmp_path: Path) -> None:
    """Two pairs of currents and two of fluxes: the command line says which."""
    path = tmp_path / "map.csv"
    rows = [f"{d:.9g},{q:.9g},{np.hypot(d, q):.9g},{0.0},{1e9},{a:.9g},{b:.9g}" for d, q, a, b in ROWS]
    path.write_text("\n".join(["D current,Q current,Is,gamma,psi_d,Flux D (mean),psi_q", *rows]), encoding="utf-8")
    chosen = ("i_d=D current", "i_q=Q current", "psi_d=Flux D (mean)")
    found = read_map(path, chosen).quantities
    assert set(found) == {"i_d", "i_q", "psi_d", "psi_q"}
    assert found["psi_d"] == pytest.approx(PSI[0], rel=1e-8)


GOOD = text(USUAL)


@pytest.mark.parametrize(
    ("content", "columns", "words"),
    [
        ("", (), ["no header line with columns for i_d and i_q (or i_s and gamma), psi_d, psi_q",
                  "--column NAME=HEADER"]),
        (GOOD.replace("psi_q_Vs", "flux"), (), ["psi_d, psi_q; the first line is 'id_A,iq_A,psi_d_Vs,flux'"]),
        (GOOD, ("psi_q=flux",), ["psi_q = 'flux'"]),
        (GOOD, ("psi=flux",), ["--column 'psi=flux': allowed: NAME=HEADER, NAME one of i_d, i_q, i_s, gamma, psi_d"]),
        (GOOD, ("psi_q=flux", "psi_q=x"), ["psi_q given twice"]),
        ("is,gamma,id_A,iq_A,psi_d,psi_q\n1,2,3,4,5,6\n",
         ("i_d=id_A", "i_q=iq_A", "i_s=is", "gamma=gamma"), ["--column: i_d, i_q and i_s, gamma are both named"]),
        (GOOD + "1,2,3\n", (), ["map.csv:227: 3 columns, wanted: 4 as in the header"]),
        (GOOD + "1,2,x,4\n", (), ["map.csv:227: psi_d = 'x', allowed: a number"]),
        (GOOD + "1,2,nan,4\n", (), ["map.csv:227: psi_d = nan, allowed: a finite number from -1e+09 to 1e+09"]),
        (text(USUAL, ";", comma=True) + "1;2;1.234,5;4\n", (), ["psi_d = '1.234,5', allowed: a number"]),
        (GOOD + '1,"2,3,4\n', (), ["map.csv:227"]),
    ],
)  # fmt: skip
def test_a_bad_table_is_refused_with_the_place(
    tmp_path: Path, content: str, columns: tuple[str, ...], words: list[str]
):
    (tmp_path / "map.csv").write_text(content, encoding="utf-8")
    with pytest.raises(FluxtrueError) as error:
        read_map(tmp_path / "map.csv", columns)
    message = str(error.value)
    assert "\n" not in message and all(word in message for word in words), message
