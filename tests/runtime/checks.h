/* The groups of checks on the double pendulum, one function each; main in checks_main.c runs them all. */
#ifndef CHECKS_H
#define CHECKS_H

/* checks_calls.c */
void check_calls(void);
void check_unsettable(void);

/* checks_life.c */
void check_instantiation(void);
void check_logging(void);
void check_reset(void);
void check_experiment(void);

/* checks_values.c */
void check_refused_values(void);
void check_calculated_values(void);
void check_null_arguments(void);
void check_other_types(void);

/* checks_state.c */
void check_rollback(void);
void check_serialization(void);
void check_foreign_states(void);
void check_interleaved(void);
void check_same_bits(void);

/* checks_steps.c */
void check_accuracy(void);
void check_communication_points(void);
void check_stop_time(void);
void check_solver_settings(void);
void check_discarded_step(void);
void check_status(void);

/* checks_derivatives.c */
void check_model_exchange(void);
void check_directional_derivatives(void);
void check_directional_settings(void);
void check_directional_refusals(void);
void check_singular_model_exchange(void);

/* checks_time_derivatives.c */
void check_polynomials(void);
void check_polynomials_hold_for_one_step(void);
void check_polynomials_in_states(void);
void check_output_derivatives(void);
void check_time_derivative_refusals(void);

/* checks_solver.c */
void check_stored_derivative(void);
void check_step_proposal(void);
void check_backward_rounding(void);
void check_stepping_over(void);
void check_states_behind(void);
void check_return_to_a_step_over(void);
void check_no_stepping_over(void);

/* checks_linear_solve.c */
void check_mass_solve(void);
void check_mass_refusals(void);

#endif
