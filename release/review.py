"""Compare the result of repo-review with the rules this project does not follow: review.py RESULT.json."""

import json
import sys
from pathlib import Path

EXPLAINED = {
    "MY100": "pyright is the type checker; the rule knows mypy, pyrefly and ty only",
    "PC140": "pyright needs the installed project, so that it runs in `make lint` and not in a commit hook",
}


def main() -> None:
    """Print what fails; end with 1 if a failure is not explained."""
    checks = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))["checks"]
    failed = {code: check for code, check in checks.items() if check["result"] is False}
    for code, check in sorted(failed.items()):
        print(f"repo-review {code} {check['description']}: {EXPLAINED.get(code, 'NOT EXPLAINED')}")
    sys.exit(not failed.keys() <= EXPLAINED.keys())


if __name__ == "__main__":
    main()
