"""What Python inside shell tests shares: the service whose URL is the script's first argument."""
import json
import sys
import urllib.request


def send(path, document):
    """POSTs the document as JSON and returns the answer's; what is refused raises."""
    request = urllib.request.Request(sys.argv[1] + path, json.dumps(document).encode(),
                                     {'Content-Type': 'application/json'})
    with urllib.request.urlopen(request) as answer:
        return json.load(answer)
