"""Many motors at once: data sets, batches, the cluster, and what the motors have in common."""

from jaxmotor.fleet._batch import Identified as Identified
from jaxmotor.fleet._batch import identify_batch as identify_batch
from jaxmotor.fleet._dataset import Dataset as Dataset
from jaxmotor.fleet._dataset import Entry as Entry
from jaxmotor.fleet._dataset import Part as Part
from jaxmotor.fleet._dataset import open_dataset as open_dataset
from jaxmotor.fleet._dataset import read_part as read_part
from jaxmotor.fleet._friction import fit_friction as fit_friction
from jaxmotor.fleet._identify_part import Options as Options
from jaxmotor.fleet._parquet import write_parquet as write_parquet
from jaxmotor.fleet._population import Population as Population
from jaxmotor.fleet._population import population as population
from jaxmotor.fleet._ready import Ready as Ready
from jaxmotor.fleet._ready import ready as ready
from jaxmotor.fleet._rubbing import simulate_rubbing as simulate_rubbing
from jaxmotor.fleet._run import Done as Done
from jaxmotor.fleet._run import Summary as Summary
from jaxmotor.fleet._run import identify_fleet as identify_fleet
from jaxmotor.fleet._shared_plan import SharedFit as SharedFit
from jaxmotor.fleet._shared_plan import SharedPlan as SharedPlan
from jaxmotor.fleet._shared_plan import fit_projected as fit_projected
from jaxmotor.fleet._shared_plan import fit_shared as fit_shared
from jaxmotor.fleet._shared_plan import project as project
from jaxmotor.fleet._shared_plan import shared_plan as shared_plan
from jaxmotor.fleet._table import read_results as read_results
