"""Test data: a `Condition` of the test matrix, a recorded `Run`, a `Dataset` of runs; display in notebooks."""

from mrdamper.data.arrays import Floats as Floats
from mrdamper.data.arrays import index_at as index_at
from mrdamper.data.conditions import Condition as Condition
from mrdamper.data.conditions import condition_groups as condition_groups
from mrdamper.data.conditions import current_levels as current_levels
from mrdamper.data.conditions import level_groups as level_groups
from mrdamper.data.conditions import same_condition as same_condition
from mrdamper.data.conditions import same_motion as same_motion
from mrdamper.data.datasets import Dataset as Dataset
from mrdamper.data.displayable import Displayable as Displayable
from mrdamper.data.runs import SPLITS as SPLITS
from mrdamper.data.runs import Run as Run
from mrdamper.data.runs import Split as Split
from mrdamper.data.runs import held_current as held_current
from mrdamper.data.runs import once_per_run as once_per_run
from mrdamper.data.runs import require_name as require_name
from mrdamper.data.sessions import SESSIONS_NEEDED as SESSIONS_NEEDED
from mrdamper.data.sessions import hour_of as hour_of
from mrdamper.data.sessions import session_folds as session_folds
from mrdamper.data.sessions import session_groups as session_groups
from mrdamper.data.sessions import session_of as session_of
