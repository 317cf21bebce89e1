"""Text tables in Shift-JIS and GB18030 are recognised by their bytes, Latin texts never mistaken for them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.base.findings import Finding
from cdtool.formats.csv import Csv
from cdtool.formats.csv_dialect.east_asian import east_asian

JAPANESE = (
    "時間,位置",
    "トルク[%],t",
    "時刻[ms],指令位置[mm],実位置[mm]",
    "帰還パルス累積,サーボモータ回転速度,溜りパルス",
    "軸1 位置(mm),軸1 速度(mm/s),エンコーダ内部温度(℃)",
    "Zeit,位置フィードバック",
)
CHINESE = (
    "时间,位置",
    "序号,时间(s),门位置(mm)",
    "电机电流(A),散热器温度(℃)",
    "时间（s）,碰撞力（N）",
    "A轴位置,B轴位置,输出力矩",
)
# Words with single accents and with several of them one behind the other, symbols, quotes and dashes.
LATIN = tuple(
    word
    for line in (
        "Größe größe Türöffnung Maßöffnung Müßiggang Gefäßöffnung Aßöl Süßöl Stößel Höhe Länge Schließkraft GRÖßE",
        "Übertragung créée créées CRÉÉE Noël européenne déplacée accélération mesurée réel référence contrôlée àéî",
        "où naïveté aiguë œuvre Œuvre posizione velocità però perché qualità città posición aceleración señal",
        "ángulo año corrección niñó ação informações tração Ångström søgeåre påøve blåøre øåæ Žižek µm °C °/s m/s²",
        "m³/h ½ ± ²³ ×10³ «Kraft» “Kraft” „Weg“ ‘x’ – — … €/kg N·m ·· ¿qué? ¡sí! º1 ª2 §3 © ®",
    )
    for word in line.split()
)


def table(names, encoding):
    rows = "".join(f"{i}{',0.5' * names.count(',')}\n" for i in range(30))
    return f"{names}\n{rows}".encode(encoding)


@pytest.mark.parametrize(
    ("names", "encoding", "shown"),
    [(names, "cp932", "Shift-JIS") for names in JAPANESE] + [(names, "gb18030", "GB18030") for names in CHINESE],
)
def test_names_are_read_and_the_encoding_is_reported(log, names, encoding, shown):
    source = Csv().columns(log(table(names, encoding)))
    plain = {name.replace("（", "(").replace("）", ")") for name in names.split(",")}
    assert {name.replace("（", "(").replace("）", ")") for name in source.names} == plain
    assert source.findings[0] == Finding("other_encoding", "", {"encoding": shown})


@given(
    st.lists(st.sampled_from(LATIN), min_size=1, max_size=40),
    st.sampled_from([",", ";", "\t", " ", "_", "\n"]),
    st.sampled_from(["cp1252", "latin-1", "cp850"]),
)
def test_texts_of_latin_words_are_latin(chosen, separator, encoding):
    assert east_asian(separator.join(chosen).encode(encoding, "ignore")) is None


@given(
    st.lists(st.from_regex(r"[A-ZÄÖÜÉ]?([a-z]+[äöüßéèêàáíóúñçœ]{1,2}){0,3}[a-z]*[°µ²]?", fullmatch=True), max_size=20)
)
def test_invented_words_with_two_accents_in_a_row_are_latin(invented):
    assert east_asian(";".join(invented).encode("cp1252")) is None


@pytest.mark.parametrize(
    ("names", "encoding"),
    [
        ("電流[A]", "cp932"),  # two characters are too few to be certain
        ("力,v", "gb18030"),
        ("ｼﾞｶﾝ,ｲﾁ,ｿｸﾄﾞ", "cp932"),
        ("時間,位置,トルク", "euc_jp"),
        ("Время,Положение,Скорость", "cp1251"),
        ("Χρόνος,Θέση,Ταχύτητα", "cp1253"),
        ("Čas,Poloha,Rychlost,Zrychlení", "cp1250"),
    ],
)
def test_what_is_not_certain_is_read_as_before(names, encoding):
    assert east_asian(table(names, encoding)) is None


def test_an_encoding_in_the_machine_file_decides(log, machine):
    text = '[channels]\ntime = { column = "時間", unit = "s" }\nspeed = { column = "電流", unit = "rad/s" }\n'
    path = log("時間,電流\n0,1\n1,2\n".encode("euc_jp"))
    wanted = machine(text + '[csv]\nencoding = "euc-jp"\n').columns
    assert list(Csv().columns(path, wanted).columns) == ["時間", "電流"]


def test_words_in_cells_do_not_change_the_decision(log):
    rows = "".join(f"{i},門が閉じた\n" for i in range(50))
    source = Csv().columns(log(("t,状態\n" + rows).encode("cp932")))
    assert source.names == ("t", "状態") and list(source.columns) == ["t"]


def test_words_behind_many_rows_of_numbers_are_recognised():
    assert east_asian(b"1,2\n" * 8000 + table(JAPANESE[3], "cp932")) == "cp932"


@pytest.mark.parametrize("names", [*JAPANESE, *CHINESE])
def test_utf_8_is_not_reported(log, names):
    findings = Csv().columns(log(table(names, "utf-8"))).findings
    assert not [finding for finding in findings if finding.kind == "other_encoding"]
