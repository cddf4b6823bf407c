"""A request that a server is to refuse."""
import json
import urllib.error
import urllib.request


def expect_refused(address, accepted):
    """With 400 option-invalid, and the word among what would be accepted."""
    try:
        urllib.request.urlopen(address).close()
    except urllib.error.HTTPError as refusal:
        problem = json.loads(refusal.read())
        assert refusal.code == 400 and problem["type"].endswith("option-invalid") and accepted in problem["accepted"], problem
        return
    raise AssertionError(f"{address} is taken")
