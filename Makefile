.PHONY: demo test lint accuracy speed

PYTHON = .venv/bin/python

demo test:
	sh bootstrap.sh $@

lint: .venv/installed
	$(PYTHON) -m pip install --quiet --disable-pip-version-check '.[dev]'
	$(PYTHON) -m ruff check

.venv/installed: pyproject.toml
	sh bootstrap.sh setup
