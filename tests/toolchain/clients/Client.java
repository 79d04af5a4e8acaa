// An FMU of FMI 2.0 as programs in Java load it: functions by their names and callbacks by JNA.
// Arguments: library, GUID, step (s), number of steps, value references. Prints what two instances in two threads give.

import com.sun.jna.Callback;
import com.sun.jna.CallbackReference;
import com.sun.jna.Memory;
import com.sun.jna.Native;
import com.sun.jna.NativeLibrary;
import com.sun.jna.Pointer;
import java.util.ArrayList;
import java.util.Arrays;
import java.util.List;
import java.util.concurrent.Callable;
import java.util.concurrent.Executors;
import java.util.stream.Collectors;

public class Client {
    public interface Logger extends Callback {
        void call(Pointer environment, String name, int status, String category, String message);
    }

    public interface Allocate extends Callback {
        Pointer call(long count, long size);
    }

    public interface Free extends Callback {
        void call(Pointer memory);
    }

    static final Logger LOGGER = (environment, name, status, category, message) -> System.err.println(message);
    static final Allocate ALLOCATE = (count, size) -> new Pointer(Native.malloc(count * size));
    static final Free FREE = memory -> Native.free(Pointer.nativeValue(memory));

    static void check(NativeLibrary library, String name, Object... arguments) {
        int status = library.getFunction("fmi2" + name).invokeInt(arguments);
        if (status != 0) {
            throw new IllegalStateException("fmi2" + name + " returned the status " + status);
        }
    }

    static List<String> run(NativeLibrary library, String guid, double step, int steps, int[] references) {
        Memory callbacks = new Memory(5L * Native.POINTER_SIZE);
        callbacks.clear();
        Callback[] functions = {LOGGER, ALLOCATE, FREE};
        for (int i = 0; i < functions.length; i++) {
            callbacks.setPointer((long) i * Native.POINTER_SIZE, CallbackReference.getFunctionPointer(functions[i]));
        }
        Object[] made = {"client", 1, guid, "file:///no/such/folder", callbacks, 0, 0};
        Pointer c = library.getFunction("fmi2Instantiate").invokePointer(made);
        check(library, "SetupExperiment", c, 0, 0.0, 0.0, 0, 0.0);
        check(library, "EnterInitializationMode", c);
        check(library, "ExitInitializationMode", c);
        List<String> rows = new ArrayList<>();
        double[] values = new double[references.length];
        for (int i = 0; i < steps; i++) {
            check(library, "DoStep", c, i * step, step, 1);
            check(library, "GetReal", c, references, (long) references.length, values);
            rows.add(Arrays.stream(values)
                .mapToObj(v -> String.format("%016x", Double.doubleToRawLongBits(v))).collect(Collectors.joining(" ")));
        }
        check(library, "Terminate", c);
        library.getFunction("fmi2FreeInstance").invokeVoid(new Object[] {c});
        return rows;
    }

    public static void main(String[] arguments) throws Exception {
        NativeLibrary library = NativeLibrary.getInstance(arguments[0]);
        double step = Double.parseDouble(arguments[2]);
        int steps = Integer.parseInt(arguments[3]);
        int[] references = Arrays.stream(arguments).skip(4).mapToInt(Integer::parseInt).toArray();
        Callable<List<String>> one = () -> run(library, arguments[1], step, steps, references);
        var threads = Executors.newFixedThreadPool(2);
        for (var rows : threads.invokeAll(List.of(one, one))) {
            rows.get().forEach(System.out::println);
        }
        threads.shutdown();
    }
}
