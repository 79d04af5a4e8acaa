/* Calls a function by CasADi's C interface at many points, which differ in one argument. */
typedef int (*External)(const double **arguments, double **results, long long *integers, double *doubles, int memory);

__attribute__((visibility("default"))) void at_points(External function, const double **arguments, int moving,
                                                      long long points, long long size, double *result,
                                                      double *doubles, long long *integers);

void at_points(External function, const double **arguments, int moving, long long points, long long size,
               double *result, double *doubles, long long *integers) {
    const double *first = arguments[moving];
    for (long long i = 0; i < points; i++) {
        double *results[1] = {result + i * size};
        arguments[moving] = first + i * size;
        function(arguments, results, integers, doubles, 0);
    }
    arguments[moving] = first;
}
