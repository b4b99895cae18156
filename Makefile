# make run    the demo: twins, server and page      make test   everything that must pass
# make check  the fast loop (format, lint, types, layers, generated files)
# make bench  all benchmarks                        make soak   the long figures
# make recordings  the scenarios of recordings/, simulated and recorded anew
# make wheel  the package with the page inside      make screenshots   pictures of every room, for README and docs
PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
PY     := $(BIN)/python
ROOT   := $(if $(filter 0,$(shell id -u)),,sudo)

.PHONY: run test check bench soak setup system page wheel recordings screenshots plots lock generate clean

run: $(VENV)/.ready frontend/dist/index.html
	$(BIN)/hubside demo

test: setup check
	$(PY) -m pytest -m "not (soak or browser or alone)" -n 2 --dist loadfile
	$(PY) -m pytest -m "(browser or alone) and not soak"  # a browser wants the machine for itself
	cd frontend && npm test

check: $(VENV)/.ready frontend/node_modules/.ready
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(PY) -m pytest tests/test_layers.py tests/test_generated.py tests/test_generated_rules.py tests/model/test_eds_write.py tests/model/test_texts.py
	cd frontend && npm run --silent check

bench: setup
	$(PY) -m bench all

soak: setup
	$(PY) -m pytest -m soak --timeout 7200

setup: system $(VENV)/.ready frontend/dist/index.html

# The browser of the end-to-end tests, the tracer of the recorder's test and tshark come from the system.
system:
	@missing=""; \
	command -v chromium >/dev/null || missing="$$missing chromium fonts-dejavu-core"; \
	command -v strace >/dev/null || missing="$$missing strace"; \
	command -v tshark >/dev/null || missing="$$missing tshark"; \
	if [ -n "$$missing" ]; then \
	  $(ROOT) apt-get update -qq && DEBIAN_FRONTEND=noninteractive $(ROOT) apt-get install -y -qq $$missing >/dev/null; \
	fi

$(VENV)/.ready: requirements/dev.txt pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(PY) -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements/dev.txt
	@mkdir -p frontend/dist
	$(PY) -m pip install --quiet --disable-pip-version-check --no-build-isolation --no-deps -e .
	@touch $@

frontend/node_modules/.ready: frontend/package-lock.json
	cd frontend && npm ci --no-audit --no-fund --loglevel=error
	@touch $@

PAGE := $(shell find frontend/src frontend/public -type f 2>/dev/null) frontend/index.html frontend/vite.config.ts
frontend/dist/index.html: frontend/node_modules/.ready $(PAGE)
	cd frontend && npm run --silent build

page: frontend/dist/index.html

# One file that needs no Node: pip install dist/hubside-*.whl && hubside demo
wheel: $(VENV)/.ready frontend/dist/index.html
	rm -rf dist
	$(PY) -m build --wheel --no-isolation --outdir dist .

# Twins in bulk, as fast as the machine goes; the same scenarios make the same recordings.
recordings: $(VENV)/.ready
	$(BIN)/hubside twin record recordings/scenarios/*.toml
	$(PY) -m tests.recording.make_pd4e
	$(PY) -m tests.recording.make_ed2

screenshots: setup
	$(PY) -m tests.e2e.screenshots

# What docs/twins.md shows of a mains failure, drawn from the twins.
plots: $(VENV)/.ready
	$(PY) -m tests.twins.make_plots docs/img

# Everything that is generated from something else; `make check` fails where it is out of date.
generate: $(VENV)/.ready frontend/node_modules/.ready
	$(PY) -m app.web.generate frontend/openapi.json
	cd frontend && npm run --silent generate
	$(BIN)/hubside od export --all-eds od/eds
	$(PY) -m tests.twins.make_page docs/twins.md
	HUBSIDE_LANGUAGE=en $(BIN)/hubside sets rules --format md > docs/rules.md

# Lock files hold versions and hashes and no registry host.
lock:
	$(BIN)/pip-compile --quiet --strip-extras --generate-hashes --no-emit-index-url --no-emit-find-links \
	  --no-emit-trusted-host --allow-unsafe --extra dev --output-file requirements/dev.txt pyproject.toml
	$(BIN)/pip-compile --quiet --strip-extras --generate-hashes --no-emit-index-url --no-emit-find-links \
	  --no-emit-trusted-host --allow-unsafe --output-file requirements/run.txt pyproject.toml

clean:
	rm -rf $(VENV) frontend/node_modules frontend/dist
