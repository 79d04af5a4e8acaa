// An FMU of FMI 2.0 as programs on .NET load it, Unity's among them: delegates of functions that dlsym finds, a copy of
// the callbacks in unmanaged memory, whose delegates the garbage collector takes while instances live.
// Arguments: library, GUID, step (s), number of steps, value references. Prints what two instances in two threads give.
using System;
using System.Linq;
using System.Runtime.InteropServices;
using System.Threading;

static class Client
{
    delegate void Logger(IntPtr environment, IntPtr name, int status, IntPtr category, IntPtr message);
    delegate IntPtr Allocate(ulong count, ulong size);
    delegate void Free(IntPtr memory);
    delegate void StepFinished(IntPtr environment, int status);

    struct Callbacks
    {
        public Logger logger;
        public Allocate allocateMemory;
        public Free freeMemory;
        public StepFinished stepFinished;
        public IntPtr componentEnvironment;
    }

    delegate IntPtr Instantiate(
        string name, int type, string guid, string resources, IntPtr callbacks, int visible, int loggingOn);
    delegate int SetupExperiment(
        IntPtr c, int toleranceDefined, double tolerance, double start, int stopDefined, double stop);
    delegate int Call(IntPtr c);
    delegate int DoStep(IntPtr c, double time, double step, int noSetState);
    delegate int GetReal(IntPtr c, uint[] references, ulong count, double[] values);
    delegate void FreeInstance(IntPtr c);

    [DllImport("libdl.so.2")] static extern IntPtr dlopen(string file, int flags);
    [DllImport("libdl.so.2")] static extern IntPtr dlsym(IntPtr library, string name);

    static IntPtr library;

    static T Function<T>(string name) where T : class
    {
        return Marshal.GetDelegateForFunctionPointer(dlsym(library, "fmi2" + name), typeof(T)) as T;
    }

    static void Check(int status)
    {
        if (status != 0) throw new InvalidOperationException("a call returned the status " + status);
    }

    static IntPtr Copied()
    {
        Callbacks functions;
        functions.logger = (environment, name, status, category, message) =>
            Console.Error.WriteLine(Marshal.PtrToStringAnsi(message));
        functions.allocateMemory = (count, size) => Marshal.AllocHGlobal((int)(count * size));
        functions.freeMemory = memory => Marshal.FreeHGlobal(memory);
        functions.stepFinished = (environment, status) => { };
        functions.componentEnvironment = IntPtr.Zero;
        IntPtr copy = Marshal.AllocHGlobal(Marshal.SizeOf(functions));
        Marshal.StructureToPtr(functions, copy, false);
        return copy;
    }

    static string[] Run(string guid, double step, int steps, uint[] references)
    {
        IntPtr callbacks = Copied();
        var c = Function<Instantiate>("Instantiate")("client", 1, guid, "file:///no/such/folder", callbacks, 0, 0);
        if (c == IntPtr.Zero) throw new InvalidOperationException("no instance");
        GC.Collect();
        Check(Function<SetupExperiment>("SetupExperiment")(c, 0, 0.0, 0.0, 0, 0.0));
        Check(Function<Call>("EnterInitializationMode")(c));
        Check(Function<Call>("ExitInitializationMode")(c));
        var rows = new string[steps];
        var values = new double[references.Length];
        for (int i = 0; i < steps; i++)
        {
            Check(Function<DoStep>("DoStep")(c, i * step, step, 1));
            Check(Function<GetReal>("GetReal")(c, references, (ulong)references.Length, values));
            rows[i] = string.Join(" ", values.Select(v => BitConverter.DoubleToInt64Bits(v).ToString("x16")));
        }
        Check(Function<Call>("Terminate")(c));
        Function<FreeInstance>("FreeInstance")(c);
        Marshal.FreeHGlobal(callbacks);
        return rows;
    }

    static void Main(string[] arguments)
    {
        library = dlopen(arguments[0], 2);
        double step = double.Parse(arguments[2], System.Globalization.CultureInfo.InvariantCulture);
        int steps = int.Parse(arguments[3]);
        var references = arguments.Skip(4).Select(uint.Parse).ToArray();
        var rows = new string[2][];
        var threads = Enumerable.Range(0, 2)
            .Select(i => new Thread(() => rows[i] = Run(arguments[1], step, steps, references))).ToArray();
        foreach (var thread in threads) thread.Start();
        foreach (var thread in threads) thread.Join();
        foreach (var run in rows) foreach (var row in run) Console.WriteLine(row);
    }
}
