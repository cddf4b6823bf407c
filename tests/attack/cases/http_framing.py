"""Finding 11, HTTP: every row of smuggling.tsv, which has nginx's answers beside ours."""
import smuggling
from attack import case

AS_EXPECTED = "every row as the table says"


@case("11 what could be read in two ways (smuggling.tsv)", expect=AS_EXPECTED)
def table(attack):
    port = attack.start().port  # its own: some rows are whole posts, and their builds would delay the cases behind them
    seen = [(what, ours, smuggling.answers(port, smuggling.bytes_of(text))) for what, text, ours, _ in smuggling.rows()]
    other = ["%s: %s for %s" % (what, got, wanted) for what, wanted, got in seen if got != wanted]
    return "; ".join(other) or AS_EXPECTED
