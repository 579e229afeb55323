.PHONY: accuracy demo fuzz kill lint properties speed test

PYTHON = .venv/bin/python
# Folders of captures with truth that the accuracy board runs over.
CAPTURES = fixtures/stool

demo test:
	sh bootstrap.sh $@

accuracy: .venv/installed
	$(PYTHON) benchmarks/accuracy.py $(CAPTURES) --out board-out

speed: .venv/installed
	$(PYTHON) benchmarks/speed.py fixtures/stool --out board-out

fuzz: .venv/installed
	$(PYTHON) -m pip install --quiet --disable-pip-version-check '.[clouds]'
	$(PYTHON) benchmarks/fuzz.py --out board-out

kill: .venv/installed
	$(PYTHON) benchmarks/kill.py fixtures/stool --out board-out

properties: .venv/installed
	$(PYTHON) benchmarks/properties.py fixtures/stool --out board-out

lint: .venv/installed
	$(PYTHON) -m pip install --quiet --disable-pip-version-check '.[dev]'
	$(PYTHON) -m ruff check

.venv/installed: pyproject.toml
	sh bootstrap.sh setup
