#!/usr/bin/env bash
# The Python client as it is installed: its types, the wheel in a clean environment, the files of the Debian package, the
# manual. The version is that of include/srnf/base.h everywhere.
# srnfd-test: release-only
# srnfd-test: slow
. "$(dirname "$0")/../support/lib.sh"

PYTHON=/usr/bin/python3
VERSION=$(make --no-print-directory version)

check 'mypy --strict finds nothing in the package' \
    mypy --config-file clients/python/pyproject.toml --cache-dir "$SRNFD_BUILD/mypy"
check 'nothing is imported but the standard library, numpy, and matplotlib for figures' \
    "$PYTHON" -B - <<'SCRIPT'
import ast, pathlib, sys
for file in pathlib.Path("clients/python/src/srnf").glob("*.py"):
    for node in ast.walk(ast.parse(file.read_text())):
        names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
        names += [node.module] if isinstance(node, ast.ImportFrom) and node.level == 0 else []
        for name in (one.split(".")[0] for one in names):
            allowed = name in sys.stdlib_module_names or name == "numpy"
            drawing = file.name == "figures.py" and name in ("matplotlib", "mpl_toolkits")
            assert allowed or drawing, f"{file.name} imports {name}"
SCRIPT
check 'everything public has its docstring' env PYTHONPATH=clients/python/src "$PYTHON" -B - <<'SCRIPT'
import inspect, srnf
missing = [n for n in srnf.__all__ if not inspect.getdoc(getattr(srnf, n))]
for kind in (getattr(srnf, n) for n in srnf.__all__ if inspect.isclass(getattr(srnf, n))):
    missing += [f"{kind.__name__}.{n}" for n, v in vars(kind).items() if not n.startswith("_") and callable(v) and not v.__doc__]
assert not missing, missing
SCRIPT

check 'the wheel is built without a network' make --no-print-directory wheel
check 'a clean environment is made' "$PYTHON" -m venv --without-pip --system-site-packages "$SCRATCH/clean"
check 'pip installs the wheel' "$SCRATCH/clean/bin/python" -m pip install --quiet --disable-pip-version-check --no-index \
    build/python/srnf-*.whl
is "$(cd "$SCRATCH" && clean/bin/srnf --version)" "srnf $VERSION" 'its command has the version of the header'
is "$(cd "$SCRATCH" && clean/bin/python -c 'import srnf; print(srnf.__version__)')" "$VERSION" 'and so has the module'
is "$(cd "$SCRATCH" && clean/bin/python -c 'import pathlib, srnf; print(pathlib.Path(srnf.__file__).with_name("py.typed").exists())')" \
    True 'types come with it'
is "$(git status --porcelain -- clients 2>/dev/null | grep -c '^??')" 0 'building leaves nothing in the tree'

DESTDIR=$SCRATCH/system
check 'the files of the package are installed' make --no-print-directory -s install-python DESTDIR="$DESTDIR" PREFIX=/usr \
    PYTHONDIR=/usr/lib/python3/dist-packages
is "$(PYTHONPATH=$DESTDIR/usr/lib/python3/dist-packages "$PYTHON" -B "$DESTDIR/usr/bin/srnf" --version)" "srnf $VERSION" \
    'its command runs'
is "$(LC_ALL=C man --warnings -l "$DESTDIR/usr/share/man/man1/srnf.1" 2>&1 >/dev/null)" '' 'the manual has no warnings'
PYTHONPATH=clients/python/src "$PYTHON" -B -m srnf completion fish | sed -n 's/.* -l \([a-z-]*\).*/\1/p' | sort -u >"$SCRATCH/options"
LC_ALL=C man -l docs/man/srnf.1 | grep -oE -- '--[a-z-]+' | sed 's/^--//' | sort -u >"$SCRATCH/named"
is "$(comm -23 "$SCRATCH/options" "$SCRATCH/named" | grep -vxE 'help|name|parameterization|format|space|resolution' | tr '\n' ' ')" '' \
    'and every option but those of fetch and the obvious'
done_testing
