/* MuJoCo without contacts: what mj_forward takes for smooth dynamics and no more. MODEL is the path of the MJCF. */
#include <string.h>

#include <mujoco/mujoco.h>

#include "call.h"

static mjModel *model;
static mjData *data;

__attribute__((constructor)) static void load(void) {
    char error[1000];
    model = mj_loadXML(MODEL, 0, error, sizeof error);
    data = model ? mj_makeData(model) : 0;
}

int sizes(void) {
    return model ? (int)model->nv : -1;
}

void call(const double in[], double out[]) {
    double b[CASE_N];
    memcpy(data->qpos, IN_X, sizeof b);
    memcpy(data->qvel, IN_QD, sizeof b);
    mj_kinematics(model, data);
    mj_comPos(model, data);
    mj_crb(model, data);
    mj_factorM(model, data);
    mj_comVel(model, data);
    mj_rne(model, data, 0, b);
    for (int i = 0; i < CASE_N; i++) {
        b[i] = IN_FORCES[i] - b[i];
    }
    mj_solveM(model, data, out, b, 1);
}
