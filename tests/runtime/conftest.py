"""What several modules share: the laws of contacts, compiled once."""

import pytest
from laws import Laws


@pytest.fixture(scope="session")
def laws(tmp_path_factory: pytest.TempPathFactory) -> Laws:
    return Laws(tmp_path_factory.mktemp("laws"))
