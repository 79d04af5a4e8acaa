/* Runs all checks on the double pendulum; exit status 0 if all hold. */
#include <stdio.h>

#include "checks.h"
#include "host.h"

static const struct {
    const char *name;
    void (*run)(void);
} GROUPS[] = {
    {"calls", check_calls},
    {"unsettable", check_unsettable},
    {"instantiation", check_instantiation},
    {"logging", check_logging},
    {"reset", check_reset},
    {"experiment", check_experiment},
    {"refused values", check_refused_values},
    {"calculated values", check_calculated_values},
    {"NULL arguments", check_null_arguments},
    {"other types", check_other_types},
    {"rollback", check_rollback},
    {"serialization", check_serialization},
    {"foreign states", check_foreign_states},
    {"interleaved instances", check_interleaved},
    {"same bits", check_same_bits},
    {"accuracy", check_accuracy},
    {"communication points", check_communication_points},
    {"stop time", check_stop_time},
    {"solver settings", check_solver_settings},
    {"discarded step", check_discarded_step},
    {"status", check_status},
    {"polynomials", check_polynomials},
    {"polynomials hold for one step", check_polynomials_hold_for_one_step},
    {"polynomials in states", check_polynomials_in_states},
    {"output derivatives", check_output_derivatives},
    {"refusals of time derivatives", check_time_derivative_refusals},
    {"stored derivative", check_stored_derivative},
    {"step proposal", check_step_proposal},
    {"stepping over", check_stepping_over},
    {"states behind", check_states_behind},
    {"return to a step over", check_return_to_a_step_over},
    {"no stepping over", check_no_stepping_over},
    {"backward rounding", check_backward_rounding},
    {"model exchange", check_model_exchange},
    {"directional derivatives", check_directional_derivatives},
    {"directional settings", check_directional_settings},
    {"directional refusals", check_directional_refusals},
    {"singular model exchange", check_singular_model_exchange},
    {"mass matrix, solved", check_mass_solve},
    {"mass matrix, refused", check_mass_refusals},
};

int main(void) {
    for (size_t i = 0; i < sizeof GROUPS / sizeof GROUPS[0]; i++) {
        printf("- %s\n", GROUPS[i].name);
        fflush(stdout);
        GROUPS[i].run();
    }
    return summary() == 0 ? 0 : 1;
}
