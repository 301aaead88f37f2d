model FirstOrder "one first-order lag"
  // Units are those of the record.
  parameter Real K = 2 "rise of the output for one unit of the command";
  parameter Real tau(min=0) = 80 "time constant";
  input Real u "command";
  output Real level(start=10);
  Real outflow = level;
equation
  tau*der(level) = K*u - outflow;
end FirstOrder;
